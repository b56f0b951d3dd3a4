"""The colour image on the flat page: painting, coverage, super-resolution from several shots."""

import restore.runtime.kernel_cache  # noqa: F401 - before the kernels: it says where they are kept
