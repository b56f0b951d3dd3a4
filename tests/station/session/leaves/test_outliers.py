"""Of a volume with six faults the leaves with faults come first."""

from __future__ import annotations

import numpy as np
import pytest

from station.session import Event, Session, read_session
from station.session.derivation.quality import run_verdict
from station.session.leaves.outliers import compared_leaves
from station.session.log.history import folded
from station.session.terms.presets import load_preset
from station.verdict.same_page import fingerprint

LEAVES = 300
LIMITS = {"thresholds": load_preset("book").thresholds.model_dump(mode="json", exclude_none=True)}
NARROW, TURNED, TWICE, CUT, BLURRED, MOVED = 41, 97, 133, 180, 222, 263
FAULTS = {
    NARROW: "width",
    TURNED: "height",
    TWICE: "similarity",
    CUT: "cropped_fraction",
    BLURRED: "blur_px",
    MOVED: "order",
}
GOOD = {
    **{"measured_fraction": 0.999, "hole_mm": 0.5, "cropped_fraction": 0.0, "depth_window_fraction": 0.5},
    **{
        "smooth_strain_rms": 0.0005,
        "sampling_ppi": 300.0,
        "blur_px": 0.7,
        "clipped_fraction": 0.001,
        "size_ci95_mm": 0.3,
    },
}


def printed(seed: int) -> str:
    return fingerprint(np.random.default_rng(seed).integers(0, 256, (200, 200, 3), np.uint8))


def measured(number: int, rng: np.random.Generator) -> dict[str, object]:
    """The result of a leaf: paper that widens through the block, measured with an error."""
    width, height = np.array([152.0 + 0.01 * number, 221.0]) + rng.normal(0.0, 0.3, 2)
    width -= 3.0 if number == NARROW else 0.0
    measures = {**GOOD, "blur_px": 0.7 + rng.normal(0.0, 0.05), "fingerprint": printed(number)}
    measures |= {"cropped_fraction": 0.2} if number == CUT else {"blur_px": 3.0} if number == BLURRED else {}
    measures |= {"fingerprint": printed(number - 1)} if number == TWICE else {}
    size = [height, width] if number == TURNED else [width, height]
    return {"page_mm": [float(side) for side in size], "dpi": 300.0, "measures": measures}


@pytest.fixture(scope="module")
def results():
    rng = np.random.default_rng(5)
    found = {number: measured(number, rng) for number in range(1, LEAVES + 1)}
    before = {str(TWICE - 1): printed(TWICE - 1), str(TWICE - 2): printed(TWICE - 2)}
    return {n: (one, run_verdict(one, LIMITS, before if n == TWICE else {}).result) for n, one in found.items()}


def session_of(volume, results) -> Session:
    """The session of a volume with these results, of which no file is read."""
    events = [read_session(volume).history.event(1)]

    def record(page: int, kind: str, slot: str, facts: dict[str, object]) -> int:
        events.append(Event(len(events) + 1, page, kind, slot, None, "", "", facts))
        return len(events)

    for number, (restored, verdict) in results.items():
        capture = record(number, "capture", "capture", {"scan": "scan.npz"})
        run = record(number, "stage", f"restore@{capture}", {"parameters": {}, "result": restored})
        record(number, "stage", f"verdict@{run}", {"parameters": LIMITS, "result": verdict})
    record(MOVED, "decision", "position", {"value": 12.5})
    return Session(volume, folded(events))


def test_six_faults_of_three_hundred_leaves_come_first(volume, results) -> None:
    compared = compared_leaves(session_of(volume, results))
    assert len(compared) == LEAVES
    worst = sorted(compared, key=lambda one: -one.rank)[: len(FAULTS)]
    named = {one.leaf.page.number: {check.name for check in one.checks if check.level != "green"} for one in worst}
    assert named.keys() == FAULTS.keys()
    assert all(FAULTS[number] in names for number, names in named.items())
    questionable = [one for one in compared if one.level != "green"]
    assert len(questionable) <= len(FAULTS) + 6  # two sizes of each leaf, one in 370 beyond three deviations


def test_a_volume_of_few_leaves_is_not_compared(volume, results) -> None:
    few = {number: results[number] for number in range(NARROW - 1, NARROW + 2)}
    compared = compared_leaves(session_of(volume, {**few, MOVED: results[MOVED]}))
    names = {check.name for one in compared for check in one.checks}
    assert not {"width", "height"} & names
    assert [one.leaf.page.number for one in compared if one.level != "green"] == [MOVED]
