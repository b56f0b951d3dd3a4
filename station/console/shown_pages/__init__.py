"""The views of a page: its row, layers, tiles, models, words."""
