"""Point clouds and depth images of other scanners."""
