"""Photographs with something over the page, or blurred: what is painted that is not the page, and what is said of it.

One kind has nothing over the page: what is said of that, and left out, is false.
`python -m bench.covered_photos [SEED [SETS]]` draws sheets, print, poses, lamps and covers afresh from the seed.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from bench.covers import KINDS, Covered, Shot, blurred
from drivers.simulated import Binding, Crumpled, Curl, Figure, Miura, Spread, Text, Wave
from drivers.simulated.scene.artwork import Artwork
from drivers.simulated.scene.scene import Scene
from drivers.simulated.scene.sheets import Sheet
from oracles.simulation.camera import Camera, Exposure
from oracles.studio import View, restored_mesh, scan_page, take_photograph
from restore import FlatMesh, Photograph
from restore.mesh.measures import signed_areas
from restore.mesh.topology import Topology
from restore.photo import Registered, paint_registered, photo_findings, register_photographs
from restore.scan import Bytes, Mask

SEED, SETS = 2026, 56
NOTHING, BLUR = "nothing", "blur"  # no cover
ALL = (*KINDS, BLUR, NOTHING)
SIZE = (1500, 1000)
DPI = 60.0  # of the page that is painted: 0.4 mm
SHOWN = 70  # characters of what is said
PAIRED = 3  # of so many sets one has a second photograph, with nothing over the page


@dataclass(frozen=True)
class Result:
    """What came of a set: the findings, or the areas in mm² of what was hidden and painted.

    deepest_mm: how far the worst painted place lies inside what hides the page. left_out: share of the page that is
    not painted from a photograph although nothing covers it there.
    """

    accepted: bool
    said: str
    hidden_mm2: float = 0.0
    painted_mm2: float = 0.0
    deepest_mm: float = 0.0
    left_out: float = 0.0


def main(seed: int = SEED, sets: int = SETS) -> None:
    """Print a line for each set, and a table of the kinds."""
    outcomes: dict[str, list[Result]] = {kind: [] for kind in ALL}
    for number, (page, scene) in enumerate(_pages(seed, sets)):
        kind = ALL[number % len(ALL)]
        rng = np.random.default_rng([seed, number, 1])
        result = _outcome(page, scene, kind, rng, paired=number // len(ALL) % PAIRED == 0)
        outcomes[kind].append(result)
        print(f"{number:>3} {kind:<11} {_line(result)}", flush=True)
    print(f"\n{'kind':<12}{'sets':>5}{'refused':>9}{'silent':>8}{'hidden cm²':>12}{'painted mm²':>13}", end="")
    print(f"{'deepest mm':>12}{'left out':>10}")
    for kind, results in outcomes.items():
        print(_row(kind, results))


def _pages(seed: int, sets: int) -> Iterator[tuple[FlatMesh, Scene]]:
    """A page for each set and its scene; every sheet serves for one set of each kind."""
    kinds = len(ALL)
    for first in range(0, sets, kinds):
        rng = np.random.default_rng([seed, first])
        sheets: tuple[Sheet, ...] = (
            Curl(radius_mm=rng.uniform(110.0, 170.0)),
            Binding(),
            Miura(),
            Wave(),
            Spread(slope_deg=rng.uniform(40.0, 65.0)),
            Crumpled(),
        )
        sheet = sheets[(first // kinds) % len(sheets)]
        print_seed = int(rng.integers(1 << 20))
        artwork: Artwork = Figure() if rng.random() < 1 / 3 else Text(seed=print_seed)
        scene = scan_page(sheet, artwork)[0]
        page = restored_mesh(sheet, artwork)
        for _ in range(first, min(first + kinds, sets)):
            yield page, scene


def _view(rng: np.random.Generator) -> View:
    """A camera that sees all of the page, anywhere within 30° of its axis."""
    distance = rng.uniform(480, 900)
    aside = distance * np.tan(np.radians(rng.uniform(0, 30)))
    angle = rng.uniform(0, 2 * np.pi)
    place = (aside * np.cos(angle), aside * np.sin(angle), distance)
    return View(place, 1.45 * distance / 520, rng.uniform(-20, 20), rng.uniform(-0.12, 0.08), 0.0)


def _light(rng: np.random.Generator) -> Exposure:
    angle, lean = rng.uniform(0, 2 * np.pi), rng.uniform(0.2, 0.9)
    warmth = rng.uniform(-0.25, 0.25)
    return Exposure(
        lamp=np.array([lean * np.cos(angle), lean * np.sin(angle), 0.75]),
        ambient=rng.uniform(0.35, 0.75),
        colour=(1.0 - max(-warmth, 0), 0.95, 1.0 - max(warmth, 0)),
        exposure=rng.uniform(0.5, 0.8),
        falloff=rng.uniform(0.0, 0.3),
    )


def _outcome(page: FlatMesh, scene: Scene, kind: str, rng: np.random.Generator, *, paired: bool) -> Result:
    camera = _view(rng).camera(SIZE)
    shot = shot_of(page, camera, take_photograph(scene, camera, exposure=_light(rng)))
    bare = Covered(blurred(shot, rng) if kind == BLUR else shot.image, np.zeros(SIZE[::-1], bool))
    covered = KINDS[kind](shot, rng) if kind in KINDS else bare
    photos = [Photograph(covered.image, kind)]
    if paired:
        photos.append(Photograph(take_photograph(scene, _view(rng).camera(SIZE), exposure=_light(rng)), "second"))
    outcome = register_photographs(page, photos)
    painting, reports = paint_registered(page, outcome, DPI)
    said = "; ".join(one.text for one in photo_findings(outcome, reports))
    if not reports[0]["accepted"]:
        return Result(False, said)
    assert painting.page_source is not None
    first = painting.page_source == 1
    hidden_in_photo = cv2.distanceTransform(covered.hidden.astype(np.uint8), cv2.DIST_L2, 5) / shot.per_mm
    depth = cv2.remap(hidden_in_photo, np.where(first[..., None], painting.source(), -1), None, cv2.INTER_LINEAR)
    mm2 = (25.4 / DPI) ** 2
    hidden = _hidden_on_page(page, outcome[0], covered)
    left_out = painting.covered & ~hidden if painting.covered is not None else np.zeros_like(hidden)
    return Result(
        True,
        said,
        float((hidden & painting.mask).sum() * mm2),
        float((first & (depth > 0)).sum() * mm2),
        float(depth.max()),
        float(left_out.sum() / painting.mask.sum()),
    )


def _hidden_on_page(page: FlatMesh, one: Registered, covered: Covered) -> Mask:
    from restore.camera.photo_camera import project_map
    from restore.texture.page import page_map

    assert one.registration is not None
    surface = page_map(page.flat, page.faces, page.vertices, DPI)
    pixels = np.nan_to_num(project_map(one.registration.camera, surface), nan=-1.0)
    hidden: Bytes = cv2.remap(covered.hidden.astype(np.uint8), pixels, None, cv2.INTER_NEAREST)
    return np.asarray(hidden > 0)


def shot_of(page: FlatMesh, camera: Camera, image: Bytes) -> Shot:
    """A photograph with the outline of the page in it."""
    pixels = camera.project(page.vertices)
    area = np.abs(signed_areas(pixels, page.faces)).sum() / np.abs(page.areas).sum()
    return Shot(image, pixels[Topology(page.faces).border], float(area**0.5))


def _line(result: Result) -> str:
    if not result.accepted:
        return f"refused: {result.said}"
    figures = f"hidden {result.hidden_mm2 / 100:6.1f} cm², of it painted {result.painted_mm2:5.0f} mm²"
    said = result.said[:SHOWN] or "SILENT"
    return f"{figures}, deepest {result.deepest_mm:4.1f} mm, left out {result.left_out:5.1%}; {said}"


def _row(kind: str, results: list[Result]) -> str:
    used = [result for result in results if result.accepted]
    silent = sum(1 for result in results if not result.said)
    hidden, painted = (sum(getattr(result, name) for result in used) for name in ("hidden_mm2", "painted_mm2"))
    deepest, left = (max((getattr(r, name) for r in used), default=0.0) for name in ("deepest_mm", "left_out"))
    cells = f"{len(results):>5}{len(results) - len(used):>9}{silent:>8}{hidden / 100:>12.1f}{painted:>13.0f}"
    return f"{kind:<12}{cells}{deepest:>12.1f}{left:>10.1%}"


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
