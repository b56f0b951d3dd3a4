"""Models of cameras: the scanner's own picture, and those of photographs."""

import restore.runtime.kernel_cache  # noqa: F401 - before the kernels: it says where they are kept
