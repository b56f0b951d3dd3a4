"""Turns a 3D scan of a warped page into a flat page: the public API.

The names, and the modules that hold them, are in `__init__.pyi`; each module is imported when it is first needed.
Programs that store, show and export pages find more in five further public modules: `restore.scan` (array types),
`restore.files` (files of limited size), `restore.formats` (kinds of files and their pictures), `restore.drawing`
(pictures of meshes) and `restore.runtime` (native libraries, compiled kernels). All other modules are private.
"""

import lazy_loader

from restore.runtime.kernel_cache import use_cache_folder

use_cache_folder()  # before a kernel is imported: numba asks then where it may be kept

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
