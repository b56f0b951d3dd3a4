"""Methods as their authors published them, to compare the default method with."""
