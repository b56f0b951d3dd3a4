"""Sets of photographs in which something went wrong, each with the truth about what its pixels show.

A kind of spoil takes a set as it should be and returns what an operator would give instead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from bench.covers import Shot, blurred, hand
from drivers.simulated import Text
from drivers.simulated.imaging.shot import printed
from drivers.simulated.scene.scene import Scene
from drivers.simulated.scene.sheets import Sheet
from oracles.simulation.camera import Camera, Exposure, photograph_scene
from oracles.simulation.mishaps import moved_card, moved_page
from oracles.simulation.photographs import PhotographSet, Shots, photograph_page
from restore import Photograph
from restore.photogrammetry import SCALE_CARD
from restore.scan import Bytes, Floats, Mask

PAGE_MM = (160.0, 110.0)
CARD_DPI = 177.8  # seven pixels to a millimetre
VIEWS = 5
MARGIN_MM = 10.0
SAME = np.array([[1.0, 0, 0], [0, 1.0, 0]])
NEW_LIGHT = Exposure(exposure=0.72, blur_px=0.8, shadow=None)


@dataclass(frozen=True, eq=False)
class View:
    """A photograph as it is given, and what is true of it.

    given   picture and focal length.
    camera  that took it, and the scene that it saw; the scene is None where it shows nothing of the page.
    before  (2, 3) takes pixels of the given picture to those of the camera.
    hidden  (h, w) True where the given picture does not show the page, although the page is there.
    """

    given: Photograph
    camera: Camera
    scene: Scene | None
    before: Floats
    hidden: Mask | None = None


Views = list[View]
Spoil = Callable[[Views, np.random.Generator], Views]


def good_set(sheet: Sheet, seed: int, size: tuple[int, int]) -> Views:
    """A set as it should be."""
    shots = Shots(size=size)
    card = SCALE_CARD.picture(CARD_DPI)
    taken = photograph_page(
        sheet, _text(seed), views=VIEWS, seed=seed, card=card, card_dpi=CARD_DPI, shots=shots, page_mm=PAGE_MM
    )
    return views_of(taken, shots.focal_px)


def views_of(taken: PhotographSet, focal_px: float) -> Views:
    """The photographs of a set, nothing done to them."""
    return [
        View(Photograph(image, f"{number}.jpg", focal_px), camera, taken.scene, SAME)
        for number, (image, camera) in enumerate(zip(taken.images, taken.cameras, strict=True), 1)
    ]


def _text(seed: int) -> Text:
    return Text(sizes_pt=(10.0,), title_pt=16.0, margin_mm=MARGIN_MM, columns=2, seed=seed)


def _again(view: View, scene: Scene, rng: np.random.Generator) -> View:
    """A view taken again of another scene."""
    image = photograph_scene(scene, view.camera, NEW_LIGHT, rng)
    return replace(view, given=replace(view.given, image=image), scene=scene)


def _with(views: Views, changed: dict[int, View]) -> Views:
    return [changed.get(number, view) for number, view in enumerate(views)]


def _scene(view: View) -> Scene:
    assert view.scene is not None
    return view.scene


def _other_print(scene: Scene, rng: np.random.Generator) -> Scene:
    """The scene with another page, of the same size and bent in the same way."""
    return replace(scene, printed=printed(_text(int(rng.integers(1 << 30))), PAGE_MM))


def another_page(views: Views, rng: np.random.Generator) -> Views:
    """One photograph is of the next page of the book."""
    k = int(rng.integers(VIEWS))
    other = _again(views[k], _other_print(_scene(views[k]), rng), rng)
    return _with(views, {k: replace(other, scene=None)})


def two_pages(views: Views, rng: np.random.Generator) -> Views:
    """Two photographs are of the next page."""
    last = {k: _again(views[k], _other_print(_scene(views[k]), rng), rng) for k in (VIEWS - 2, VIEWS - 1)}
    return _with(views, {k: replace(view, scene=None) for k, view in last.items()})


def _push(rng: np.random.Generator) -> tuple[Floats, float]:
    """A push of 3 to 20 mm over the table, and a turn of up to 5 degrees."""
    angle = rng.uniform(0, 2 * np.pi)
    return rng.uniform(3.0, 20.0) * np.array([np.cos(angle), np.sin(angle)]), rng.uniform(-5.0, 5.0)


def page_moved_once(views: Views, rng: np.random.Generator) -> Views:
    """The page lies elsewhere in one photograph."""
    k = int(rng.integers(VIEWS))
    return _with(views, {k: _again(views[k], moved_page(_scene(views[k]), *_push(rng)), rng)})


def page_moved_for_good(views: Views, rng: np.random.Generator) -> Views:
    """The page lies elsewhere from the third photograph on."""
    push = _push(rng)
    return _with(views, {k: _again(views[k], moved_page(_scene(views[k]), *push), rng) for k in range(2, VIEWS)})


def card_moved(views: Views, rng: np.random.Generator) -> Views:
    """The card lies elsewhere from the third photograph on."""
    push = _push(rng)
    return _with(views, {k: _again(views[k], moved_card(_scene(views[k]), *push), rng) for k in range(2, VIEWS)})


def one_blurred(views: Views, rng: np.random.Generator) -> Views:
    """One photograph is out of focus or was shaken."""
    k = int(rng.integers(VIEWS))
    return _with(views, {k: _changed(views[k], blurred(_shot(views[k]), rng))})


def all_blurred(views: Views, rng: np.random.Generator) -> Views:
    """All photographs are out of focus."""
    sigma = rng.uniform(4.0, 8.0)
    return [_changed(view, blurred(_shot(view), rng, sigma)) for view in views]


def one_cropped(views: Views, rng: np.random.Generator) -> Views:
    """One photograph was cropped."""
    k = int(rng.integers(VIEWS))
    return _with(views, {k: _cropped(views[k], rng)})


def all_cropped(views: Views, rng: np.random.Generator) -> Views:
    """Each photograph was cropped to the same size, elsewhere in each."""
    return [_cropped(view, rng) for view in views]


def _cropped(view: View, rng: np.random.Generator) -> View:
    """A view without a tenth of its width and height."""
    height, width = view.given.image.shape[:2]
    left, top = int(rng.integers(width // 10)), int(rng.integers(height // 10))
    image = view.given.image[top : top + height * 9 // 10, left : left + width * 9 // 10].copy()
    before = np.array([[1.0, 0, left], [0, 1.0, top]])
    return replace(view, given=replace(view.given, image=image), before=before)


def one_mirrored(views: Views, rng: np.random.Generator) -> Views:
    """One photograph is mirrored."""
    k = int(rng.integers(VIEWS))
    return _with(views, {k: _mirrored(views[k])})


def all_mirrored(views: Views, _rng: np.random.Generator) -> Views:
    """All photographs are mirrored, as cameras beside a screen do."""
    return [_mirrored(view) for view in views]


def _mirrored(view: View) -> View:
    image = np.ascontiguousarray(view.given.image[:, ::-1])
    before = np.array([[-1.0, 0, image.shape[1] - 1.0], [0, 1.0, 0]])
    return replace(view, given=replace(view.given, image=image), before=before)


def zoomed(views: Views, rng: np.random.Generator) -> Views:
    """Two photographs are zoomed, and their files say so."""
    return _with(views, {k: _zoomed(views[k], rng, is_known=True) for k in (1, 3)})


def zoomed_unsaid(views: Views, rng: np.random.Generator) -> Views:
    """Two photographs are zoomed by the camera's software, and no file tells a focal length."""
    changed = _with(views, {k: _zoomed(views[k], rng, is_known=False) for k in (1, 3)})
    return [replace(view, given=replace(view.given, focal_px=None)) for view in changed]


def _zoomed(view: View, rng: np.random.Generator, *, is_known: bool) -> View:
    height, width = view.given.image.shape[:2]
    factor = rng.uniform(1.1, 1.5)
    matrix = np.array([[factor, 0, (1 - factor) * (width - 1) / 2], [0, factor, (1 - factor) * (height - 1) / 2]])
    image = cv2.warpAffine(view.given.image, matrix, (width, height), flags=cv2.INTER_CUBIC)
    focal = view.given.focal_px * factor if is_known and view.given.focal_px else view.given.focal_px
    given = replace(view.given, image=image, focal_px=focal)
    return replace(view, given=given, before=cv2.invertAffineTransform(matrix))


def only_two(views: Views, _rng: np.random.Generator) -> Views:
    """There are two photographs."""
    return views[:2]


def blank(views: Views, rng: np.random.Generator) -> Views:
    """Nothing is printed on the page."""
    empty = replace(_scene(views[0]).printed, image=np.full_like(_scene(views[0]).printed.image, 238))
    return [_again(view, replace(_scene(view), printed=empty), rng) for view in views]


def glossy(views: Views, rng: np.random.Generator) -> Views:
    """The page is coated, and mirrors a lamp."""
    gloss = rng.uniform(0.5, 1.0)
    lamp = np.array([rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), 1.0])
    changed = []
    for view in views:
        scene = replace(_scene(view), printed=replace(_scene(view).printed, gloss=gloss))
        image = photograph_scene(scene, view.camera, replace(NEW_LIGHT, lamp=lamp), rng)
        changed.append(replace(view, given=replace(view.given, image=image), scene=scene))
    return changed


def one_hand(views: Views, rng: np.random.Generator) -> Views:
    """A hand lies on the page in one photograph."""
    k = int(rng.integers(VIEWS))
    return _with(views, {k: _under_hand(views[k], rng)})


def all_hands(views: Views, rng: np.random.Generator) -> Views:
    """A hand holds the page in every photograph, not quite at one place."""
    seed = int(rng.integers(1 << 30))
    return [_under_hand(view, np.random.default_rng(seed)) for view in views]


def _under_hand(view: View, rng: np.random.Generator) -> View:
    covered = hand(_shot(view), rng)
    return replace(_changed(view, covered.image), hidden=covered.hidden)


def no_card(views: Views, rng: np.random.Generator) -> Views:
    """No card lies beside the page."""
    return [_again(view, replace(_scene(view), lying=None), rng) for view in views]


def card_in_two(views: Views, rng: np.random.Generator) -> Views:
    """The card lies beside the page in two photographs."""
    return _with(views, {k: _again(views[k], replace(_scene(views[k]), lying=None), rng) for k in (0, 2, 4)})


def noise(views: Views, rng: np.random.Generator) -> Views:
    """Three pictures of nothing."""
    shape = views[0].given.image.shape
    return [
        replace(_changed(view, rng.integers(0, 256, shape, np.uint8)), scene=None) for view in views[: VIEWS // 2 + 1]
    ]


def one_place(views: Views, rng: np.random.Generator) -> Views:
    """All photographs are taken from one place."""
    here = views[0].camera
    cameras = [replace(here, position=here.position + rng.normal(0, 2.0, 3)) for _ in views]
    return [
        _again(replace(view, camera=camera), _scene(view), rng) for view, camera in zip(views, cameras, strict=True)
    ]


KINDS: dict[str, Spoil] = {
    "another page": another_page,
    "two pages": two_pages,
    "page moved once": page_moved_once,
    "page moved": page_moved_for_good,
    "card moved": card_moved,
    "one blurred": one_blurred,
    "all blurred": all_blurred,
    "one cropped": one_cropped,
    "all cropped": all_cropped,
    "one mirrored": one_mirrored,
    "all mirrored": all_mirrored,
    "zoomed": zoomed,
    "zoomed, unsaid": zoomed_unsaid,
    "two views": only_two,
    "blank": blank,
    "glossy": glossy,
    "hand in one": one_hand,
    "hand in all": all_hands,
    "no card": no_card,
    "card in two": card_in_two,
    "noise": noise,
    "one place": one_place,
}


def _changed(view: View, image: Bytes) -> View:
    return replace(view, given=replace(view.given, image=image))


def _shot(view: View) -> Shot:
    """A view as what covers it wants it: with the outline of the page, and pixels to the millimetre."""
    along = np.linspace(0.0, 1.0, 40)[:, None]
    corners = np.array([[0.0, 0.0], [1, 0], [1, 1], [0, 1]]) * PAGE_MM
    sides = [a + along * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    outline = view.camera.project(_scene(view).surface(np.concatenate(sides)))
    x, y = outline.T
    area = abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) / 2
    return Shot(view.given.image, outline, float(np.sqrt(area / (PAGE_MM[0] * PAGE_MM[1]))))


def truth(view: View, pixels: Floats) -> Floats:
    """(n, 2) mm on the page that pixels (n, 2) of a given photograph show, NaN where they show something else."""
    if view.scene is None:
        return np.full((len(pixels), 2), np.nan)
    own = pixels @ view.before[:, :2].T + view.before[:, 2]
    flat, _ = PhotographSet((), (view.camera,), view.scene).truth_at(0, own)
    if view.hidden is not None:
        cols, rows = np.rint(pixels).astype(int).T
        flat[view.hidden[rows, cols]] = np.nan
    return flat


def given(views: Sequence[View]) -> list[Photograph]:
    """The photographs."""
    return [view.given for view in views]
