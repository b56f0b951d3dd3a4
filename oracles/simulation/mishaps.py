"""What goes wrong while a page is photographed: page or card are pushed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from drivers.simulated.scene.scene import Scene, Surface


def moved_page(scene: Scene, shift_mm: Sequence[float], turn_deg: float) -> Scene:
    """The scene after its page was pushed (2,) mm over the table and turned counter-clockwise about its middle."""
    page = np.unique(scene.faces[scene.on_page])
    rotation = Rotation.from_euler("z", turn_deg, degrees=True).as_matrix()
    middle = scene.vertices[page].mean(axis=0)
    shift = middle + [*shift_mm, 0.0] - rotation @ middle
    vertices = scene.vertices.copy()
    vertices[page] = vertices[page] @ rotation.T + shift
    was = scene.surface
    surface = Surface(was.sheet, was.page_mm, rotation @ was.rotation, rotation @ was.shift + shift)
    return replace(scene, vertices=vertices, surface=surface)


def moved_card(scene: Scene, shift_mm: Sequence[float], turn_deg: float) -> Scene:
    """The scene after what lies beside the page was pushed (2,) mm and turned counter-clockwise about its middle."""
    lying = scene.lying
    if lying is None:
        return scene
    middle = (lying.middle_mm[0] + shift_mm[0], lying.middle_mm[1] + shift_mm[1])
    return replace(scene, lying=replace(lying, middle_mm=middle, turn_deg=lying.turn_deg + turn_deg))
