"""Carry the corrections of a page over to its second capture.

Corrections without points are carried at once. Points lie on the image of the earlier scan; they go through both flat
pages, which are true to scale. The fingerprint decides first whether both show the same page: another page of like
layout matches as well as the same one does.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from restore import PageEdits, RangeScan, RestoredPage, RestoreError, Settings, SurfaceMesh, load_scan, restore_leaves
from restore.scan import Bytes, Floats
from station.session.captures.scans import scan_path
from station.session.log.events import Event, slot_of
from station.session.log.history import History
from station.session.log.store import Session
from station.session.terms.rules import CARRIED, DROPPED, EDITS
from station.verdict.same_page import fingerprint, similarity

SAME_PAGE = 0.84  # similarity of fingerprints, the amber limit of the quality check
DPI, FEATURES = 100.0, 3000
MM_PER_INCH = 25.4
MIN_MATCHES, MAX_RMS_MM = 30, 0.7
MAX_SCALE = 0.01  # by which two pages of true scale may differ
SETTINGS = Settings(points=1000, dpi=DPI)

Scan = RangeScan | SurfaceMesh
Points = tuple[tuple[float, ...], ...]
Move = Callable[[Points], Points]


def uncarried(history: History, later: Event) -> tuple[Event, PageEdits] | None:
    """Return the scan that was replaced by a later one, with its corrections.

    None where it has none, and where the later scan has or had corrections of its own.
    """
    slot = slot_of(EDITS, later)
    if later.parent is None or any(event.slot == slot for event in history.events[later.number :]):
        return None
    earlier = history.event(later.parent)
    edits = _edits_of(history, earlier)
    return (earlier, edits) if edits.model_fields_set else None


def carried_edits(session: Session, earlier: Event, later: Event, edits: PageEdits) -> PageEdits:
    """Return the corrections of a scan as they fit a later one; records nothing.

    Takes seconds where they have points. Raises OSError.
    """
    tool, by = CARRIED, edits.by
    if edits.has_points:
        try:
            move = motion_between(_scan_of(session, earlier), _scan_of(session, later))
        except RestoreError:
            move = None
        tool = DROPPED if move is None else CARRIED
        edits = edits.dropped("spine", "outline", "masks") if move is None else edits.moved(move)
    return edits.dropped("scan").model_copy(update={"by": by.model_copy(update={"tool": tool})})


def _edits_of(history: History, capture: Event) -> PageEdits:
    """Return the corrections of a scan; empty without any."""
    event = history.current(capture.page, slot_of(EDITS, capture))
    return PageEdits() if event is None or event.value is None else event.value


def _scan_of(session: Session, capture: Event) -> Scan:
    return load_scan(scan_path(session, capture), **capture.captured.reading)


def motion_between(earlier: Scan, later: Scan) -> Move | None:
    """Return how points (n, 2) px move from one scan's image to another's.

    None where the scans do not show the same page, or their flat pages do not register.
    """
    try:
        one, two = (_whole(scan) for scan in (earlier, later))
    except RestoreError:
        return None
    if similarity(fingerprint(one.image), fingerprint(two.image)) < SAME_PAGE:
        return None
    matrix = register_pages(one.image, two.image)
    return None if matrix is None else lambda points: _through_pages(points, one, two, matrix)


def _whole(scan: Scan) -> RestoredPage:
    return restore_leaves(scan, SETTINGS, layout="whole").page("page")


def register_pages(one: Bytes, two: Bytes) -> Floats | None:
    """Return the rigid motion (2, 3) px between two flat pages, None when not known.

    one, two: (h, w, 3) at DPI.
    """
    orb = cv2.ORB.create(FEATURES)
    (keys_one, found_one), (keys_two, found_two) = (
        orb.detectAndCompute(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), None) for image in (one, two)
    )
    if found_one is None or found_two is None:
        return None
    matches = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(found_one, found_two)
    if len(matches) < MIN_MATCHES:
        return None
    source = np.array([keys_one[match.queryIdx].pt for match in matches])
    target = np.array([keys_two[match.trainIdx].pt for match in matches])
    limit = MAX_RMS_MM * DPI / MM_PER_INCH
    matrix, inliers = cv2.estimateAffinePartial2D(source, target, ransacReprojThreshold=limit)
    if matrix is None or int(inliers.sum()) < MIN_MATCHES:
        return None
    near = inliers.ravel().astype(bool)
    apart = source[near] @ matrix[:, :2].T + matrix[:, 2] - target[near]
    rms, scale = float(np.sqrt((apart**2).sum(axis=1).mean())), float(np.sqrt(abs(np.linalg.det(matrix[:, :2]))))
    return np.asarray(matrix) if rms <= limit and abs(scale - 1.0) <= MAX_SCALE else None


def _through_pages(points: Points, one: RestoredPage, two: RestoredPage, matrix: Floats) -> Points:
    """Move points (n, 2) px from the image of one page's scan to that of the other's.

    A point off the paper keeps its distance from the nearest place on it.
    """
    known = np.argwhere(np.isfinite(two.page_map[..., 0]))
    places = np.argwhere(np.isfinite(one.page_map[..., 0]))
    seen = one.page_map[places[:, 0], places[:, 1]]
    moved = []
    for point in np.array(points):
        nearest = int(np.argmin(((seen - point) ** 2).sum(axis=1)))
        row, col = places[nearest]
        x, y = matrix @ np.array([col, row, 1.0])
        there = known[int(np.argmin(((known - [y, x]) ** 2).sum(axis=1)))]
        x, y = two.page_map[there[0], there[1]] + (point - seen[nearest])
        moved.append((float(x), float(y)))
    return tuple(moved)
