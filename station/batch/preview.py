"""A page as the morning report shows it: small, inside the HTML itself."""

from __future__ import annotations

import base64
import io

from PIL import Image

from restore.scan import Bytes

PICTURE_PX, QUALITY = 320, 80  # the longer side, and of JPEG: some 15 kB a page


def preview(picture: Bytes, side: int = PICTURE_PX) -> str:
    """Return a page (h, w, 3) as an element of HTML, its longer side within the given pixels."""
    image = Image.fromarray(picture)
    image.thumbnail((side, side))
    out = io.BytesIO()
    image.save(out, "JPEG", quality=QUALITY)
    data = base64.b64encode(out.getvalue()).decode()
    return f"<img alt='' width='{image.width}' height='{image.height}' src='data:image/jpeg;base64,{data}'>"
