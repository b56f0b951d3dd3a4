"""Corrections of meshes as files hold them."""
