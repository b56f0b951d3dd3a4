"""Light and shadow on the page: the shape that they follow from, the lamps, their removal."""
