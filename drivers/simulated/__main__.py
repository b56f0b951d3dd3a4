"""`python -m drivers.simulated CONFIG`: the simulated device on a socket."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from drivers.scanner import ScannerError
from drivers.simulated.scanner import rig
from drivers.simulated.serve import LOCALHOST, listen, serve
from restore.files import read_toml


def main() -> int:
    """Serve until Ctrl-C."""
    parser = argparse.ArgumentParser(prog="python -m drivers.simulated", description=__doc__)
    parser.add_argument("config", type=Path, help="the station's configuration (TOML), driver = simulated")
    parser.add_argument("--port", type=int, default=0, help="port to listen on; by default any free one")
    arguments = parser.parse_args()
    try:
        config = read_toml(arguments.config)
        device = rig(config.get("scanner", {}), clock=time.monotonic).device
    except (OSError, ValueError, ScannerError) as error:
        print(f"{arguments.config}: {error}", file=sys.stderr)
        return 2
    with listen(arguments.port) as listener:
        print(f"{LOCALHOST}:{listener.getsockname()[1]}", flush=True)
        try:
            serve(device, listener)
        except KeyboardInterrupt:
            return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
