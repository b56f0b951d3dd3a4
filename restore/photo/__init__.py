"""Photographs of the scanned page by other cameras, and the page painted from them."""

from restore.photo.page import Registered, paint_registered, photo_findings, register_photographs
from restore.photo.photograph import Photograph, read_photograph
from restore.photo.read import read_photographs
from restore.photo.shading import remove_registered_shading

__all__ = [
    "Photograph",
    "Registered",
    "paint_registered",
    "photo_findings",
    "read_photograph",
    "read_photographs",
    "register_photographs",
    "remove_registered_shading",
]
