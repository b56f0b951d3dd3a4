"""Base of the code: checked arguments, kernels, libraries, threads.

The names for other packages are in `__init__.pyi`; they are imported when they are first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
