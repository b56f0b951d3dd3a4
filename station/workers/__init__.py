"""Processes that compute: each ends with its parent, and a crash costs one page."""
