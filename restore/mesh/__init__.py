"""Triangle meshes: validation, adjacency, orientation, measures, surface fits, lengths, decimation, rasterising."""
