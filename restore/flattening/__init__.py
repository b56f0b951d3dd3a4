"""Methods that carry a surface mesh into the plane with its lengths, and what they share."""
