"""One capture: the shots, their settings, and their data as a range scan."""
