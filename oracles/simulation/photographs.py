"""Sets of hand-held photographs of one page on a table, with the exact truth about it.

The table carries a printed card beside the page. Each shot has a pose, an exposure, a white balance, a shadow and, when
asked, a focal length and principal point of its own; all share the lens's distortion. The numbers are those of a phone
with a lens of 26 mm (in terms of 35 mm film), held at arm's length.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import ExifTags, Image

from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.raycast import RayCaster
from drivers.simulated.imaging.shot import printed
from drivers.simulated.scene.artwork import Artwork
from drivers.simulated.scene.scene import Scene, Table, TablePicture, place_sheet
from drivers.simulated.scene.sheets import PageSize, Sheet
from oracles.simulation.camera import Camera, Exposure, Shadow, look_at, photograph_scene
from restore.scan import Bytes, Floats

FILM_MM, FILM_DIAGONAL_MM = 26.0, 43.27  # of the lens, and of a frame of 36 × 24 mm
DEPTH_MM = 900.0  # of the scene's middle from the origin of its frame: any will do
GAP_MM = 25.0  # from the page to the card: a raised edge must not hide it from the side
CARD_ROOM_MM = 60.0  # that the card takes below the page
FILLED = 0.88  # of the picture's shorter side, by page and card seen from above
NEARER, FARTHER = 1.02, 1.15  # of the distance at which they fill so much
TILT_DEG = (18.0, 38.0)  # of the oblique shots; every fifth is taken from above
ABOVE_DEG = 6.0
JPEG_QUALITY = 92


@dataclass(frozen=True)
class Shots:
    """How a set is taken.

    size           width and height in pixels.
    radial, tangential  distortion of the lens, as `Camera` has it.
    focal_jitter   standard deviation of the focal length from shot to shot, as a share: focus breathing.
    centre_jitter  standard deviation of the principal point from shot to shot, as a share of the width: stabilisation.
    shadows        whether somebody's shadow falls on page and table, another in each shot.
    """

    size: tuple[int, int] = (4000, 3000)
    radial: tuple[float, float, float] = (0.06, -0.11, 0.05)
    tangential: tuple[float, float] = (4e-4, -3e-4)
    focal_jitter: float = 0.0
    centre_jitter: float = 0.0
    shadows: bool = True

    @property
    def focal_px(self) -> float:
        """Focal length in pixels, without jitter."""
        return FILM_MM / FILM_DIAGONAL_MM * float(np.hypot(*self.size))


@dataclass(frozen=True, eq=False)
class PhotographSet:
    """Photographs (h, w, 3) uint8 RGB of a scene, and the cameras that took them."""

    images: tuple[Bytes, ...]
    cameras: tuple[Camera, ...]
    scene: Scene

    def save(self, folder: Path) -> list[Path]:
        """Write the photographs as JPEG with the focal length in EXIF; returns their paths in order."""
        paths = [folder / f"IMG_{number:04d}.jpg" for number in range(1, len(self.images) + 1)]
        for path, image in zip(paths, self.images, strict=True):
            path.write_bytes(encode_jpeg(image))
        return paths

    def truth_at(self, number: int, pixels: Floats) -> tuple[Floats, Floats]:
        """What pixels (n, 2) of photograph `number` (from 0) show: places (n, 2) mm on the page, points (n, 3) mm.

        NaN where they do not show the page.
        """
        camera = self.cameras[number]
        rays = camera.through(pixels)
        face, _ = RayCaster(self.scene.vertices, self.scene.faces).first_hit(camera.position, rays)
        on_page = face >= 0
        on_page[on_page] = self.scene.on_page[face[on_page]]
        flat, points = np.full((len(pixels), 2), np.nan), np.full((len(pixels), 3), np.nan)
        # On the plane of the face, in double precision: depths are single.
        maps, face, rays = FaceMaps.of(self.scene), face[on_page], rays[on_page].astype(float)
        start = maps.offsets[face] - maps.along_normal(face, np.broadcast_to(camera.position, rays.shape))
        points[on_page] = camera.position + rays * (start / maps.along_normal(face, rays))[:, None]
        flat[on_page] = maps.page(face, points[on_page])
        return flat, points


def photograph_page(
    sheet: Sheet,
    artwork: Artwork,
    *,
    views: int,
    seed: int,
    card: Bytes | None = None,
    card_dpi: float = 300.0,
    shots: Shots | None = None,
    page_mm: PageSize = (280.0, 200.0),
    table: Table = "light",
) -> PhotographSet:
    """Photographs of a printed, warped page on a table; card (h, w) or (h, w, 3) uint8 is what lies below it."""
    shots = shots or Shots()
    rng = np.random.default_rng(seed)
    scene = place_sheet(sheet, printed(artwork, page_mm), depth_mm=DEPTH_MM, table=table)
    scene = replace(scene, lying=None if card is None else _laid(card, card_dpi, page_mm, rng))
    cameras = [_camera(number, views, page_mm, shots, rng) for number in range(views)]
    images = [photograph_scene(scene, camera, _exposure(shots, rng), rng) for camera in cameras]
    return PhotographSet(tuple(images), tuple(cameras), scene)


def encode_jpeg(image: Bytes, *, film_mm: float | None = FILM_MM) -> bytes:
    """A photograph (h, w, 3) uint8 RGB as JPEG, with its focal length in terms of 35 mm film in EXIF."""
    exif = Image.Exif()
    if film_mm is not None:
        exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.FocalLengthIn35mmFilm] = round(film_mm)
    out = io.BytesIO()
    Image.fromarray(image).save(out, "JPEG", quality=JPEG_QUALITY, exif=exif)
    return out.getvalue()


def _laid(card: Bytes, dpi: float, page_mm: PageSize, rng: np.random.Generator) -> TablePicture:
    image = card if card.ndim == 3 else np.repeat(card[..., None], 3, axis=2)
    below = -(page_mm[1] / 2 + GAP_MM + CARD_ROOM_MM / 2)
    middle = (float(rng.uniform(-15, 15)), below + float(rng.uniform(-3, 0)))
    return TablePicture(image, dpi, middle, float(rng.uniform(-3, 3)))


def _camera(number: int, views: int, page_mm: PageSize, shots: Shots, rng: np.random.Generator) -> Camera:
    """The camera of a shot: every fifth from above, the others all round."""
    extent = np.array([page_mm[0], page_mm[1] + GAP_MM + CARD_ROOM_MM])
    fitting = (extent * shots.focal_px / (np.array(shots.size) * FILLED)).max()
    distance = fitting * rng.uniform(NEARER, FARTHER)
    above = number % 5 == 0
    tilt = np.radians(rng.uniform(0, ABOVE_DEG) if above else rng.uniform(*TILT_DEG))
    around = 2 * np.pi * (number / views + rng.uniform(-0.04, 0.04))
    towards = np.array([np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), np.cos(tilt)])
    target = np.array([0.0, -(GAP_MM + CARD_ROOM_MM) / 2, -DEPTH_MM]) + [*rng.uniform(-6, 6, 2), 0.0]
    # Seen from the side, the near edge is larger: further off by as much as the page is wide that way.
    distance *= 1 + 0.25 * np.sin(tilt)
    width = shots.size[0]
    return look_at(
        target,
        target + distance * towards,
        size=shots.size,
        focal_px=shots.focal_px * (1 + shots.focal_jitter * rng.standard_normal()),
        roll_deg=float(rng.uniform(-8, 8)),
        offset=(
            width * (0.004 + shots.centre_jitter * rng.standard_normal()),
            width * (-0.003 + shots.centre_jitter * rng.standard_normal()),
        ),
        radial=shots.radial,
        tangential=shots.tangential,
    )


def _exposure(shots: Shots, rng: np.random.Generator) -> Exposure:
    """Exposure, white balance, sharpness and shadow of a shot."""
    warm = 0.04 * rng.standard_normal()
    shadow = Shadow(
        edge_mm=(float(rng.uniform(-150, 150)), float(rng.uniform(-120, 120))),
        into_deg=float(rng.uniform(0, 360)),
        width_mm=float(rng.uniform(30, 120)),
        share=float(rng.uniform(0.1, 0.35)),
    )
    return Exposure(
        colour=(1.0, 0.96 - warm / 2, 0.88 - warm),
        exposure=0.75 * float(np.exp(0.08 * rng.standard_normal())),
        blur_px=float(rng.uniform(0.6, 1.0)),
        noise=float(rng.uniform(1.5, 3.0)),
        shadow=shadow if shots.shadows else None,
    )


def views_from(photographs: PhotographSet, numbers: Sequence[int]) -> PhotographSet:
    """Some photographs of a set."""
    chosen = [(photographs.images[number], photographs.cameras[number]) for number in numbers]
    return PhotographSet(tuple(image for image, _ in chosen), tuple(camera for _, camera in chosen), photographs.scene)
