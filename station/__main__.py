"""`python -m station` is `planish`."""

import sys

from station.cli import main

sys.exit(main())
