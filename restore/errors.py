"""What can go wrong in a restoration.

RestoreError           anything below; carries the exit code and what to do now
├── BadInput           a file or an argument is not usable (exit code 3)
├── NotEnoughSurface   the scan holds too little of a page (exit code 5)
└── LibraryMissing     the system lacks a library that the work needs (exit code 2)
"""


class RestoreError(Exception):
    """A restoration that cannot continue.

    `hint` says what to do now; `exit_code` is the command's.

    >>> try:
    ...     load_scan("gone.obj")
    ... except RestoreError as error:
    ...     print(f"{error}: {error.hint} (exit code {error.exit_code})")
    gone.obj does not exist: check the name and the folder (exit code 3)
    """

    exit_code = 1

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


class BadInput(RestoreError):
    """A file is damaged or an argument is out of range.

    The message names the file and what is wrong.

    >>> Projector(1, 1)
    Traceback (most recent call last):
        ...
    restore.errors.BadInput: a projector of 1 × 1 pixels cannot be
    """

    exit_code = 3


class NotEnoughSurface(RestoreError):
    """Raised when no connected piece of surface is large enough to be a page.

    >>> restore(RangeScan(np.full((48, 64, 3), np.nan), None, np.zeros((48, 64, 2))))
    Traceback (most recent call last):
        ...
    restore.errors.NotEnoughSurface: the scan holds 0 samples, a page takes 50 and more
    """

    exit_code = 5


class LibraryMissing(RestoreError):
    """A native library cannot be loaded.

    The hint names the package of the system that holds it.
    """

    exit_code = 2
