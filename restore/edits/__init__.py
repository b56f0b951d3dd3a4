"""Corrections by hand: their format, their checks, and how they change the sheets of a scan."""
