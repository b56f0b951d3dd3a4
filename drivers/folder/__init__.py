"""A scanner whose own program is used by hand: each new file in a folder is a shot."""
