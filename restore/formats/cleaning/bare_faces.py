"""Faces without texture coordinates in a textured mesh.

Editors leave them where they fill holes.
"""

from __future__ import annotations

from restore.findings import Finding
from restore.numerics.robust import MAJORITY
from restore.scan import Mask


def kept_faces(bare: Mask, *, pictured: bool = True) -> tuple[Mask, tuple[Finding, ...]]:
    """Return the faces to keep, with a finding where some are bare.

    The bare ones are left out, since nothing was measured there and no picture shows them. Where they are most of the
    surface, all are kept, and the picture has to be left out. All are kept, too, without a picture, or where none is
    textured.
    bare: (m,). Returns (m,) bool.
    """
    count = int(bare.sum())
    if not pictured or count in (0, len(bare)):
        return bare | True, ()
    fraction = count / len(bare)
    if fraction > MAJORITY:  # the surface is kept instead of the picture
        return bare | True, (Finding.of("picture_left_out", fraction, count=count, total=len(bare)),)
    return ~bare, (Finding.of("bare_faces", fraction, count=count, total=len(bare)),)
