"""Light and shadow on the page.

The shape that they follow from, the lamps, their removal.
"""
