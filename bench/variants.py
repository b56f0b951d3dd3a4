"""`python -m bench.variants`: one page scanned with a scanner of each variant of the command profile.

Prints what each variant does without, how damage is detected, how many commands a scan takes, and whether range image,
colours and page are those of the default profile to the byte. Returns 1 when one differs.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from hashlib import sha256

from drivers.scsi.in_process import InProcess
from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.device import Lens, SimulatedDevice
from drivers.simulated.scanner import rig
from drivers.vivid900.capture.camera import Vivid900
from drivers.vivid900.connecting import calibrations
from drivers.vivid900.link import Link
from drivers.vivid900.profile.profile import PROFILES, SIMULATED, Profile, load_profile
from drivers.vivid900.settings import VividSettings
from restore import RangeScan, Settings, restore
from station.images.png import encode_png

SCENE = {"sheet": "curl", "artwork": "text", "page_mm": [280, 200]}
SHOT = VividSettings(mode="fast", distance_mm=900.0, laser_power=60)  # one shot, without previews
COARSE = Settings(points=300, dpi=60)
PARTS = "range image", "colours", "page"


@dataclass(frozen=True)
class Run:
    """A scan with a profile: the digests of its parts, and the commands that the device received."""

    profile: Profile
    digests: tuple[str, ...]
    commands: int
    parked: bool


def run(profile: Profile, lens: Lens) -> Run:
    """Scan the page behind a lens."""
    clock = VirtualClock()
    device = SimulatedDevice(lens, profile, clock)
    link = Link(InProcess(device), None, clock, clock.sleep)
    with Vivid900(link, profile, calibrations(None, lens=lens.name)) as scanner:
        scan = scanner.capture(SHOT)
    return Run(profile, _digests(scan), len(list(device.log.named("command"))), device.is_parked)


def _digests(scan: RangeScan) -> tuple[str, ...]:
    page = restore(scan, COARSE)
    texture = b"" if scan.texture is None else scan.texture.tobytes()
    parts = scan.points.tobytes(), texture, encode_png(page.image, page.dpi)
    return tuple(sha256(part).hexdigest() for part in parts)


def main() -> int:
    """Print the table."""
    lens = rig({"driver": "simulated", "seed": 1, "scene": SCENE}).device.lens
    first = run(load_profile(SIMULATED), lens)
    wrong = 0
    print(f"{'variant':<18} {'damage':<12} {'commands':>8}  {'same':<12} does without")
    print(f"{SIMULATED:<18.18} {first.profile.integrity:<12} {first.commands:>8}  {'-':<12}")
    for path in sorted((PROFILES / "variants").glob("*.toml")):
        one = run(load_profile(path), lens)
        other = [part for part, mine, its in zip(PARTS, one.digests, first.digests, strict=True) if mine != its]
        other += [] if one.parked else ["parking"]
        wrong += bool(other)
        difference = f"not {', '.join(other)}" if other else "to the byte"
        lacks = ", ".join(name.removeprefix("commands.").removeprefix("blocks.") for name in one.profile.absences)
        print(
            f"{path.stem:<18} {one.profile.integrity:<12} {one.commands:>8}  {difference:<12} {lacks or '-'}",
            flush=True,
        )
    print(f"wrong: {wrong}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
