"""State of a reconstruction: cameras and points.

They are in millimetres over the table once the card is found.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from restore.camera.photo_camera import PhotoCamera
from restore.photogrammetry.cameras.align import Similarity, agreeing_markers, triangulate_markers, upright
from restore.photogrammetry.cameras.bundle import Tracks
from restore.photogrammetry.cameras.card import ScaleCard
from restore.photogrammetry.card_pose import find_card
from restore.report import ScaleReport
from restore.scan import Floats

ARM_MM = 400.0  # from the camera to the page, where the scale is unknown
MARKER_SIGMA_PX = 0.1  # of the centres of the card's markers


@dataclass
class Model:
    """Views by index of the photograph, their cameras, and points (n, 3) mm.

    markers: photograph → marker → pixel (2,).
    scale: where the scale comes from, for the report.
    corners: (4, 3) mm of the card, once it is found.
    """

    views: list[int]
    cameras: list[PhotoCamera]
    points: Floats
    markers: Mapping[int, Mapping[int, Floats]]
    card: ScaleCard | None
    scale: ScaleReport = field(default_factory=ScaleReport)
    corners: Floats | None = None

    def become(self, other: Model) -> None:
        """Take over the state of another."""
        vars(self).update(vars(other))

    @property
    def by_photograph(self) -> dict[int, PhotoCamera]:
        """Index of the photograph → its camera."""
        return dict(zip(self.views, self.cameras, strict=True))

    def set_frame(self, points: Floats) -> Similarity:
        """Bring the model into millimetres over the table.

        Its centre is at the origin and up as in the first view. Without a card, the table is the plane of points
        (n, 3). Returns the change of frame.
        """
        up = -self.cameras[0].rotation[1]
        found = self.card and find_card(self.by_photograph, self.markers, self.card)
        if self.card and found:
            pose, error, count = found
            level = upright(np.array([0.0, 0.0, 1.0]), pose.rotation.T @ up)
            turn = level @ pose.rotation.T
            change = Similarity(1 / pose.scale, turn, -turn @ pose.shift / pose.scale)
            self.scale = {"from": "card", "markers": count, "residual_mm": error}
            outline = self.card.outline
            self.corners = change.points(pose.points(np.column_stack([outline, np.zeros(len(outline))])))
        else:
            middle = np.median(points, axis=0)
            positions = np.array([camera.position for camera in self.cameras])
            _, _, principal = np.linalg.svd(points - middle, full_matrices=False)
            normal = principal[2] * (np.sign(principal[2] @ (positions.mean(axis=0) - middle)) or 1.0)
            turn = upright(normal, up)
            scale = ARM_MM / float(np.median(np.linalg.norm(positions - middle, axis=1)))
            change = Similarity(scale, turn, -scale * turn @ middle)
            self.scale = {"from": "none"}
        self.cameras = [change.camera(camera) for camera in self.cameras]
        self.points = change.points(self.points)
        return change

    def with_markers(self, points: Floats, tracks: Tracks) -> tuple[Floats, Tracks]:
        """Return points and tracks with those of the markers.

        They hold the cameras next to the page.
        points: (n, 3) mm.
        """
        agreeing = agreeing_markers(self.by_photograph, self.markers)
        found = triangulate_markers(self.by_photograph, agreeing)
        seen = [
            (number, len(points) + index, agreeing[view][marker])
            for index, marker in enumerate(found)
            for number, view in enumerate(self.views)
            if marker in agreeing.get(view, {})
        ]
        if not seen:
            return points, tracks
        view, point, pixels = (np.array(column) for column in zip(*seen, strict=True))
        return np.concatenate([points, list(found.values())]), Tracks(
            np.concatenate([tracks.view, view]),
            np.concatenate([tracks.point, point]),
            np.concatenate([tracks.pixels, pixels]),
            np.concatenate([tracks.sigma, np.full(len(view), MARKER_SIGMA_PX)]),
        )
