"""The surface of a sheet: facets and creases fitted to the samples of a range image."""
