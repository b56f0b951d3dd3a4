"""The colour image on the flat page.

Texturing, coverage, super-resolution from several captures.
"""
