"""The reference page of constants: how many of each kind, and those that restoring a scan reads."""

from __future__ import annotations

from collections import Counter

from drivers.simulated import Pose, shoot
from drivers.simulated.scene.artwork import Text
from oracles.constants import KINDS, ROOT, Constant, Sources, called_in, constants_in
from oracles.sheets import CASES
from restore import restore

PAGE = ROOT / "docs" / "reference" / "constants.md"
PACKAGE = "restore"
SEED = 58
HEAD = """# Constants

Written by `python -m bench.constants --write-docs`. A constant is exact (mathematics, units, arithmetic), standard
(prescribed by a format or a device), a budget (of time, memory, iterations or samples), or tuned. The default path is
what restoring a FAST and a FINE scan calls.
"""


def on_default_path() -> list[Constant]:
    """The constants that restoring a scan reads, in the order of the modules."""

    def run() -> None:
        pose = Pose(tilt_deg=3.0)
        restore(shoot(CASES["multi-fold"].sheet, Text(), mode="fast", table="white", pose=pose, seed=SEED)[0])
        restore(shoot(CASES["binding"].sheet, Text(), mode="fine", table="dark", pose=pose, seed=SEED)[0])

    read = Sources(PACKAGE).read_by(called_in(PACKAGE, run))
    return [constant for constant in constants_in(PACKAGE) if (constant.module, constant.name) in read]


def page() -> str:
    """The reference page: how many of each kind, and a line for each that is tuned and on the default path."""
    read = on_default_path()
    everywhere, there = (Counter(one.kind for one in some) for some in (constants_in(PACKAGE), read))
    counts = [f"| {kind} | {everywhere[kind]} | {there[kind]} |" for kind in KINDS]
    rows = [
        f"| {one.module.removeprefix('restore/').removesuffix('.py')} | `{one.name}` | {one.value} | {cell(one)} |"
        for one in read
        if one.kind == "tuned"
    ]
    sections = (
        ["| kind | all of `restore` | default path |", "|---|---|---|", *counts],
        ["## Tuned, on the default path\n", "| module | constant | value | reason |", "|---|---|---|---|", *rows],
    )
    return "\n".join([HEAD, *sections[0], "", *sections[1]]) + "\n"


def cell(constant: Constant) -> str:
    """The reason of a constant as a cell of a table."""
    return constant.reason.replace("|", "\\|")
