"""Methods that map a surface mesh into the plane with its edge lengths."""
