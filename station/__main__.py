"""Start of the command `planish`, also as `python -m station`."""

import sys

from station.interrupt import end_on_ctrl_c


def main() -> int:
    """Load the command and run it with the arguments of the process.

    Returns the exit code.
    """
    end_on_ctrl_c()
    from station.cli import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
