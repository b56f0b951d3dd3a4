"""The files of one page, as a run writes them."""
