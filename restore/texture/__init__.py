"""The colour image on the flat page: painting, coverage, super-resolution from several shots."""
