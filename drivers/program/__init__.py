"""A scanner that is a program: it is run for each shot, and writes a scan file."""
