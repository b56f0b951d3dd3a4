"""Files of pictures: PNG and TIFF, colour profiles, metadata, the coverage map."""
