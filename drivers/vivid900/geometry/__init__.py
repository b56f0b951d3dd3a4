"""The geometry of the scanner: lenses, calibration, triangulation."""
