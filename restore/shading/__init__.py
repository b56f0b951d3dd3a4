"""Light and shadow on the page: the shape that they follow from, the lamps, their removal."""

import restore.runtime.kernel_cache  # noqa: F401 - before the kernels: it says where they are kept
