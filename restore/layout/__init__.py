"""Where the spine of an opened book is, whether it is one, and its leaves as separate sheets."""
