"""The colour image on the flat page: texturing, coverage, super-resolution."""
