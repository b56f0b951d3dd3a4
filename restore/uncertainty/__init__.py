"""Estimate the uncertainty of positions on a page."""
