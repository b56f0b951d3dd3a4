"""Calibration of a scanner's body and lens from scans of a marker board."""
