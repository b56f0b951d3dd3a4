"""Triangle meshes: checks, adjacency, measures, lengths, decimation."""
