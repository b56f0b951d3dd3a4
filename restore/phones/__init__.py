"""Folders that scanning programs of phones export.

They hold a coarse mesh, and photographs whose cameras are known.
"""
