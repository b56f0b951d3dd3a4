"""Faces without texture coordinates in a mesh whose other faces have them, as editors leave where they fill holes."""

from __future__ import annotations

from restore.findings import Finding
from restore.scan import Mask

MAX_BARE = 0.5  # of the faces: where more are bare, the surface is kept instead of the picture


def kept_faces(bare: Mask, *, pictured: bool = True) -> tuple[Mask, tuple[Finding, ...]]:
    """(m,) True for the faces to keep, given the bare ones (m,), with a finding where there are any.

    The bare ones are left out, as nothing was measured there and no picture shows them. Where they are most of the
    surface, all are kept, and the picture has to be left out. All are kept, too, where there is no picture, or none is
    textured.
    """
    count = int(bare.sum())
    if not pictured or count in (0, len(bare)):
        return bare | True, ()
    share = count / len(bare)
    if share > MAX_BARE:
        return bare | True, (Finding.of("picture_left_out", share, count=count, total=len(bare)),)
    return ~bare, (Finding.of("bare_faces", share, count=count, total=len(bare)),)
