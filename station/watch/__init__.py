"""`planish watch`: every scan that arrives in a folder is restored once, or set aside once with the reason."""
