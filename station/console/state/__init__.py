"""What the console works with between requests, and what changes it."""
