"""The colour image on the flat page: painting, what of the page was seen, finer colour from several shots."""
