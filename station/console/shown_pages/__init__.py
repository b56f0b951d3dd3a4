"""What a page is looked at by: rows, layers, tiles, models, words."""
