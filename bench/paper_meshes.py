"""What the paper says of meshes and of hidden parts (§3.2, Figs. 2 and 8), run on simulated scans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivers.simulated import Crumpled, Truth, shoot
from oracles.markers import marker_error
from oracles.sheets import CASES
from restore import RangeScan, Settings, restore
from restore.mesh.triangulate import lattice
from restore.prepared.facet_sheet import FacetSheet, decimate_sheet
from restore.prepared.prepare import prepare
from restore.range_image.facets.sheet import Sheet, depth_distance
from restore.scan import Floats, Ints

SEED = 5
FIG_2_POINTS = 1200  # the paper's
POINTS = 1000
PAPER_MM = (0.38, 0.623, 64.84)  # §3.2: mean, standard deviation and maximum, crumpled page, 1,200 points
SEVERE = Crumpled(planes=24, tilt_deg=13.0, steep_deg=55.0, seed=3)
HIDDEN_MM = ((95.0, 120.0), (28.0, 11.0))  # from the lower left of the page: middle and half axes of what is hidden
MARGIN_MM = 6.0  # a marker this near to the hidden part belongs to it


def main() -> None:
    """Print the distances of Fig. 2, those of all sheets, and what a hidden part costs."""
    fig_2()
    distances()
    fig_8()


def fig_2() -> None:
    """Irregular against uniform meshes of equal size."""
    print(f"\nFig. 2: depth from the mesh of {FIG_2_POINTS} points to the dense surface, mm: mean, sd, max")
    print("the paper, crumpled page, irregular mesh: {}, {}, {}".format(*PAPER_MM))
    row = "{:<18}{:>26}{:>26}{:>14}"
    print(row.format("sheet", "irregular", "uniform", "ratio of means"))
    for name, sheet in {"crumpled": CASES["crumpled"].sheet, "severely crumpled": SEVERE}.items():
        surface = surface_of(shoot(sheet, seed=SEED)[0])
        irregular, uniform = (
            depth_distance(surface, *sparse(surface, FIG_2_POINTS)),
            depth_distance(surface, *even(surface, FIG_2_POINTS)),
        )
        ratio = uniform["mean_mm"] / irregular["mean_mm"]
        print(row.format(name, _figures(irregular), _figures(uniform), f"{ratio:.1f}"), flush=True)


def distances() -> None:
    """How far the decimated mesh lies from the surface, sheet by sheet."""
    print(f"\nDecimation: depth from the mesh of {POINTS} points to the dense surface, mm: mean, sd, max")
    for name, case in CASES.items():
        surface = surface_of(shoot(case.sheet, seed=SEED)[0])
        print(f"{name:<18}{_figures(depth_distance(surface, *sparse(surface, POINTS))):>26}", flush=True)


def fig_8() -> None:
    """A severely crumpled page, whole and with a part hidden from the scanner."""
    print(
        "\nFig. 8: a severely crumpled page; markers off by mm rms, found of those looked for, share of the page shown"
    )
    scan, truth = shoot(SEVERE, seed=SEED)
    covered = hide(scan, truth)
    lost = float((scan.measured & ~covered.measured).sum() / scan.measured.sum())
    markers = {k: m for k, m in truth.markers.items() if not _hidden(m, MARGIN_MM).any()}
    row = "{:<28}{:>9}{:>9}{:>9}"
    for name, shot in {"all seen": scan, f"{lost:.1%} of the samples hidden": covered}.items():
        page = restore(shot, Settings())
        error = marker_error(page.image, page.dpi, markers)
        shown = page.mask.sum() * (25.4 / page.dpi) ** 2 / np.prod(truth.page_mm)
        print(row.format(name, f"{error.rms_mm:.3f}", f"{error.found}/{error.of}", f"{shown:.1%}"), flush=True)


def surface_of(scan: RangeScan) -> Sheet:
    """The prepared surface of a scan that has a grid."""
    prepared = prepare(scan)
    if not isinstance(prepared, FacetSheet):
        raise TypeError("a range scan is prepared to a sheet")
    return prepared.sheet


def sparse(surface: Sheet, points: int) -> tuple[Floats, Ints]:
    """Grid positions (n, 2) and faces of the irregular mesh, as the pipeline makes it."""
    mesh, nodes = decimate_sheet(surface, points)
    return nodes, mesh.faces


def even(surface: Sheet, points: int) -> tuple[Floats, Ints]:
    """Grid positions (n, 2) and faces of a uniform mesh with no fewer points."""
    strides = range(int(np.sqrt(surface.inside.sum() / points)) + 1, 0, -1)
    return next(found for stride in strides if len((found := lattice(surface.inside, stride))[0]) >= points)


def hide(scan: RangeScan, truth: Truth) -> RangeScan:
    """The scan without the samples of HIDDEN_MM, as if a fold stood before them."""
    hidden = _hidden(truth.flat)
    return replace(scan, points=np.where(hidden[..., None], np.nan, scan.points))


def _hidden(flat: Floats, margin: float = 0.0) -> np.ndarray:
    middle, half = np.array(HIDDEN_MM)
    return np.asarray(np.linalg.norm((flat - middle) / (half + margin), axis=-1) < 1)


def _figures(distance: dict[str, float]) -> str:
    return ", ".join(f"{distance[name]:.3f}" for name in ("mean_mm", "sd_mm", "max_mm"))


if __name__ == "__main__":
    main()
