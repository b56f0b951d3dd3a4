"""The Minolta Vivid 900 laser range scanner."""
