"""Checks and repairs of the files of a session."""
