"""Folders that scanning programs of phones export: a coarse mesh, and photographs whose cameras are known."""

from restore.phones.capture import PhoneCapture, is_phone_capture, load_phone_capture

__all__ = ["PhoneCapture", "is_phone_capture", "load_phone_capture"]
