"""Changes that an operator makes, from the command line or the web interface."""
