"""How far a run of several stages is as a whole, and how long it still takes."""

from __future__ import annotations

from collections.abc import Mapping

from station.progress import WHOLE, Progress

# Of one run on two cores, in any unit: only their ratios count, and a slow machine is slow in all of them.
A_VIEW = {"features": 1.0, "surface": 2.0, "edge": 0.3}
A_PAIR = {"matching": 0.14, "cameras": 0.3}
A_PAGE = {"prepare": 0.8, "decimate": 0.5, "flatten": 0.2, "refine": 0.2}
A_VIEW_PAINTED = {"register": 0.0, "texture": 0.5}


def expected_of_photographs(views: int) -> dict[str, float]:
    """Return the relative time of each stage of `planish photos`, in order."""
    pairs = views * (views - 1) / 2
    before = {"features": views * A_VIEW["features"], **{stage: pairs * each for stage, each in A_PAIR.items()}}
    surface = {stage: views * A_VIEW[stage] for stage in ("surface", "edge")}
    return before | surface | A_PAGE | {stage: views * each for stage, each in A_VIEW_PAINTED.items()}


def with_whole(progress: Progress, expected: Mapping[str, float]) -> Progress:
    """Return a progress that also reports the fraction of the whole run.

    Stages that are not expected count nothing. The fraction never falls, also when stages are repeated.
    expected: stage → time, in their order.
    """
    total, stages = sum(expected.values()), list(expected)
    furthest = 0.0

    def report(stage: str, done: float) -> None:
        nonlocal furthest
        progress(stage, done)
        if stage in expected:
            before = sum(expected[one] for one in stages[: stages.index(stage)])
            furthest = max(furthest, (before + done * expected[stage]) / total)
            progress(WHOLE, furthest)

    return report
