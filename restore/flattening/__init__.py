"""Methods that carry a surface mesh into the plane with its lengths, and what they share."""

import restore.runtime.kernel_cache  # noqa: F401 - before the kernels: it says where they are kept
