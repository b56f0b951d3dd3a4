"""How much light the page and the table give back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.simulated.scene.scene import Scene, TablePicture
from restore.scan import Bytes, Floats, Ints

_CODE = np.arange(256) / 255
LINEAR = np.where(_CODE <= 0.04045, _CODE / 12.92, ((_CODE + 0.055) / 1.055) ** 2.4).astype(np.float32)
"""Linear light (256,) of each sRGB code (IEC 61966-2-1)."""

# sRGB: stained matte board, red reflectance 0.09; planed beech, 0.55; white laminate, of the colour of paper, 0.81.
BOARD = {"dark": (84, 76, 68), "light": (196, 158, 116), "white": (232, 231, 227)}
GRAIN = {"dark": 0.04, "light": 0.10, "white": 0.01}  # relative swing of the board from grain to grain
REMAP_COLS = 4096  # cv2.remap takes images up to 32,767 pixels a side, so long lists are folded
GRAIN_MM = 7.0  # from one growth ring to the next on a plain-sawn board


def linear(codes: NDArray[np.float32]) -> NDArray[np.float32]:
    """Convert sRGB codes (…), 0 to 255, to linear light (…), 0 to 1."""
    return np.interp(codes, np.arange(256), LINEAR).astype(np.float32)


def srgb(light: NDArray[np.float32]) -> NDArray[np.float32]:
    """Convert linear light (…) to sRGB codes (…), 0 to 255, not rounded."""
    light = np.clip(light, 0, 1)
    return np.asarray(np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055) * 255)


class Paint:
    """Colour of a scene's surfaces, averaged over a footprint.

    `red_reflectance` and `colour_codes` make one. What lies on the table is seen by `colour_codes` alone.
    image: (h, w, k) float32, the print in any unit.
    board: (k,), the table in the same unit.
    footprint_mm: size on the page of what one sample sees.
    """

    def __init__(
        self, scene: Scene, image: NDArray[np.float32], board: NDArray[np.float32], footprint_mm: float
    ) -> None:
        self._scene, self._board = scene, board
        self._image, self._pixels_per_mm = _averaged(image, scene.printed.dpi, footprint_mm)
        self._lying = None
        if scene.lying is not None and image.shape[2] == 3:
            self._lying = _averaged(scene.lying.image.astype(np.float32), scene.lying.dpi, footprint_mm)

    def __call__(self, face: Ints, uv: Floats) -> NDArray[np.float32]:
        """Return the colour (n, k) of faces at positions.

        face: (n,).
        uv: (n, 2) mm on the page or table.
        """
        colour = self._print(uv)
        table = ~self._scene.on_page[face]
        if table.any():
            colour[table] = self._boards(uv[table])
        return colour

    def _print(self, uv: Floats) -> NDArray[np.float32]:
        from_top = (uv - [0.0, self._scene.printed.page_mm[1]]) * [1.0, -1.0]
        return _sampled(self._image, from_top * self._pixels_per_mm - 0.5)

    def _boards(self, uv: Floats) -> NDArray[np.float32]:
        """Boards with grain along x, its rings slowly wandering."""
        ring = uv[:, 1] / GRAIN_MM + 0.8 * np.sin(uv[:, 0] / 90) + 0.5 * np.sin(uv[:, 0] / 37 + uv[:, 1] / 60)
        swing = 1 + GRAIN[self._scene.table] * np.sin(2 * np.pi * ring)
        colour = (self._board * swing[:, None]).astype(np.float32)
        if self._lying is not None and self._scene.lying is not None:
            self._lay(colour, uv, self._scene.lying, *self._lying)
        return colour

    @staticmethod
    def _lay(
        colour: NDArray[np.float32],
        uv: Floats,
        lying: TablePicture,
        image: NDArray[np.float32],
        pixels_per_mm: Floats,
    ) -> None:
        """Put a picture over the colours (n, 3) of places (n, 2) mm on the table."""
        cos, sin = np.cos(np.radians(lying.turn_deg)), np.sin(np.radians(lying.turn_deg))
        own = (uv - np.array(lying.middle_mm)) @ np.array([[cos, sin], [-sin, cos]]).T
        size = np.array(image.shape[1::-1])
        pixels = own * [1.0, -1.0] * pixels_per_mm + (size - 1) / 2
        on = ((pixels > -0.5) & (pixels < size - 0.5)).all(axis=1)
        colour[on] = _sampled(image, pixels[on])


def _averaged(image: NDArray[np.float32], dpi: float, footprint_mm: float) -> tuple[NDArray[np.float32], Floats]:
    """Return a picture at most as fine as a footprint.

    image: (h, w, k). Returns it and its pixels to a millimetre (2,).
    """
    import cv2

    pixel = 25.4 / dpi
    shrink = min(pixel / footprint_mm, 1.0)
    size = [max(round(n * shrink), 1) for n in image.shape[1::-1]]
    small = np.atleast_3d(cv2.resize(image, size, interpolation=cv2.INTER_AREA))
    return small, np.array(size) / (np.array(image.shape[1::-1]) * pixel)


def _sampled(image: NDArray[np.float32], pixels: Floats) -> NDArray[np.float32]:
    """Return values (n, k) of a picture (h, w, k) at pixels (n, 2) x, y."""
    import cv2

    if not len(pixels):  # cv2 takes no empty images
        return np.empty((0, image.shape[2]), np.float32)
    folded = np.zeros((-(-len(pixels) // REMAP_COLS) * REMAP_COLS, 2), np.float32)
    folded[: len(pixels)] = pixels
    x, y = folded.reshape(-1, REMAP_COLS, 2).transpose(2, 0, 1)
    colour = cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(colour.reshape(len(folded), -1)[: len(pixels)])


def red_reflectance(scene: Scene, footprint_mm: float) -> Paint:
    """Return the reflectance at 690 nm, 0 to 1, from the red channel: paint with k = 1.

    Carbon black, cyan, blue and green inks are dark there, magenta, yellow and red ones nearly as bright as the paper.
    """
    return Paint(scene, LINEAR[scene.printed.image[..., :1]], LINEAR[_board(scene)[:1]], footprint_mm)


def colour_codes(scene: Scene, footprint_mm: float) -> Paint:
    """Paint with k = 3: sRGB codes, 0 to 255."""
    return Paint(scene, scene.printed.image.astype(np.float32), _board(scene).astype(np.float32), footprint_mm)


def _board(scene: Scene) -> Bytes:
    """Return the sRGB (3,) of the table; black without one."""
    return np.array(BOARD.get(scene.table, (0, 0, 0)), np.uint8)
