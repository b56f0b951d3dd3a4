"""Whether a valley is a spine, and what to do with the page."""

from __future__ import annotations

from restore.layout.finding import Advice, BookPrior, IsSpine, LayoutFinding
from restore.layout.spine import Spine
from restore.numerics.robust import MAJORITY, NEARLY_ALL

VALLEY_DEG = -15.0  # turn of a gutter, at most; of a page that lies bent for another reason it is less
ARCH_DEG = 1.0  # by which the pages of a book arch back next to it; a folded card is flat there to 0.1
LEAN_DEG = 2.5  # a spine is parallel to the sides of the page, as far as a binder cuts at right angles
OVERLAP_MM = 1.0  # of the facing page that each leaf keeps: a cut that is placed worse may take letters
NO_PRINT, PRINT = 0.002, 0.02  # of the height: between them it is not clear whether print runs over the spine
STRIP = 0.35  # of a leaf: less is a strip of the facing page


def decide(
    spine: Spine | None, crossing: float | None, widths_mm: tuple[float, float] | None, prior: BookPrior | None
) -> LayoutFinding:
    """Return the finding on a spine.

    crossing: fraction of its height over which print runs.
    widths_mm: left and right of it.
    """
    if spine is None or widths_mm is None:
        return LayoutFinding("whole", "no", None, reasons=("the surface has no valley from head to tail",))
    is_spine, reason = _is_spine(spine)
    advice, because = _advice(is_spine, crossing, widths_mm, prior)
    return LayoutFinding(
        advice,
        is_spine,
        spine.place,
        "page",
        spine.sigma_mm,
        spine.turn_deg,
        spine.beyond_deg,
        spine.bands,
        crossing,
        widths_mm,
        reasons=tuple(one for one in (because, reason) if one),
    )


def _is_spine(spine: Spine) -> tuple[IsSpine, str]:
    doubts = {
        f"the valley turns by {-spine.turn_deg:.0f}° only": spine.turn_deg > VALLEY_DEG,
        f"the pages arch back by {spine.beyond_deg:.1f}° only": spine.beyond_deg < ARCH_DEG,
        # A spine runs from head to tail.
        f"the valley runs along {spine.bands:.0%} of the height only": spine.bands < NEARLY_ALL,
        f"the valley leans by {spine.lean_deg:.1f}°": abs(spine.lean_deg) > LEAN_DEG,
        f"its place is known to {spine.sigma_mm:.1f} mm only": spine.sigma_mm > OVERLAP_MM,
    }
    doubt = next((reason for reason, holds in doubts.items() if holds), "")
    # The valley of a wave may be half as deep. Its sides bend the other way, as those of a card that springs open do.
    if spine.turn_deg > MAJORITY * VALLEY_DEG or spine.beyond_deg < -MAJORITY * ARCH_DEG:
        return "no", doubt
    # Such another valley or ridge is one of the creases of a map, a letter or a crumpled page.
    if spine.other_deg > MAJORITY * -spine.turn_deg:
        return "no", f"another crease turns by {spine.other_deg:.0f}°"
    if doubt:
        return "unsure", doubt
    return "sure", f"the valley turns by {-spine.turn_deg:.0f}° and the pages arch back by {spine.beyond_deg:.1f}°"


def _advice(
    is_spine: IsSpine, crossing: float | None, widths_mm: tuple[float, float], prior: BookPrior | None
) -> tuple[Advice, str]:
    if is_spine == "no":
        return "whole", ""
    if crossing is not None and crossing > PRINT:
        return "whole", f"print runs over the spine along {crossing:.1%} of its height"
    if is_spine == "unsure":
        return "ask", ""
    left, right = widths_mm
    leaf = (left + right) / 2 if prior is None else prior.leaf_mm[0]
    if min(widths_mm) < STRIP * leaf:
        return ("left" if left > right else "right"), f"the facing page is a strip of {min(widths_mm):.0f} mm"
    if crossing is not None and crossing > NO_PRINT:
        return "ask", f"print may run over the spine: along {crossing:.1%} of its height"
    return "split", ""
