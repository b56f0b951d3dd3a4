"""The spine of an opened book, and its leaves as separate sheets."""
