"""The default method: the page whose edges keep their surface lengths."""
