"""The sheet found in a range image, and the table below it."""
