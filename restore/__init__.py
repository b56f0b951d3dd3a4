"""Turn a 3D scan of a warped page into the flat page it once was. This is the only public door.

The names, and the modules that hold them, are in `__init__.pyi`; each module is imported when it is first needed.
"""

import lazy_loader

from restore.runtime import kernel_cache  # noqa: F401 - before any kernel is imported: it says where they are kept

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
