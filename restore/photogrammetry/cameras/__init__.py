"""Cameras of the photographs, and the points that they agree on."""
