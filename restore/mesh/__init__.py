"""Triangle meshes: validation, adjacency, orientation, measures, surface fits, lengths, decimation, rasterising."""

import restore.runtime.kernel_cache  # noqa: F401 - before the kernels: it says where they are kept
