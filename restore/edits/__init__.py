"""Corrections by hand.

Their format, their checks, and how they change the sheets of a scan.
"""
