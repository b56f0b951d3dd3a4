"""Corrections by hand: their format, their checks, and their effect on sheets of a scan."""
