"""Range images: the segmentation of the sheet, its denoised surface, its border and its holes."""

import restore.runtime.kernel_cache  # noqa: F401 - before the kernels: it says where they are kept
