"""Photographs of the scanned page by other cameras, and the page painted from them."""

from restore.photo.even import even_registered
from restore.photo.page import Registered, paint_registered, reasons, register_photographs
from restore.photo.photograph import Photograph, read_photograph

__all__ = [
    "Photograph",
    "Registered",
    "even_registered",
    "paint_registered",
    "read_photograph",
    "reasons",
    "register_photographs",
]
