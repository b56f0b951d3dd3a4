# The names for other packages and where they come from. They are imported when they are first used.
from .kernel_cache import notify_when_compiling as notify_when_compiling
from .native import (
    SYSTEM_LIBRARIES as SYSTEM_LIBRARIES,
)
from .native import (
    LibraryMissing as LibraryMissing,
)
from .native import (
    SystemLibrary as SystemLibrary,
)
from .native import (
    load_pymeshlab as load_pymeshlab,
)
from .native import (
    missing_libraries as missing_libraries,
)
from .results import Kept as Kept
from .rows import Rows as Rows
from .threads import in_threads as in_threads
