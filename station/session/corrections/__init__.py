"""Corrections of a page: its own, those of rules, those carried over."""
