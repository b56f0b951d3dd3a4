"""Originals of a page: scans of the scanner, scans and photographs of others."""
