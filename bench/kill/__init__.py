"""Faults at every file event of a run: a signal or an error of the disk, and what the folder of results holds then."""
