"""Folders that scanning programs of phones export: a coarse mesh, and photographs whose cameras are known."""
