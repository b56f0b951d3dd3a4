"""The IIIF export in a viewer that libraries use: OpenSeadragon in Chromium, over a plain web server."""

from __future__ import annotations

import io
import json
from functools import partial
from http.server import SimpleHTTPRequestHandler
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
from PIL import Image

from oracles.local_server import local_server
from station.archive.deliver import deliver
from station.archive.formats import Format
from station.archive.volume import Volume
from station.console.vendored import PAGE
from tests.station.archive.conftest import NOW, picture
from tests.station.console_page.conftest import _no_leaks, browser

if TYPE_CHECKING:
    from playwright.sync_api import Browser

__all__ = ["_no_leaks", "browser"]

SIZE = (800, 600)
LIKE = 0.95  # correlation of the picture on the screen with the page: the viewer smooths when it reduces
OTHER = 0.8  # of the two pages, which have the same title and margins: 0.66
VIEW = """<!doctype html><html><head><style>html, body, #view { margin: 0; height: 100%; background: #fff }</style>
<script src="openseadragon.min.js"></script></head><body><div id="view"></div><script>
const viewer = OpenSeadragon({ id: "view", tileSources: SERVICE + "/info.json", showNavigationControl: false,
  drawer: "canvas", visibilityRatio: 1 });
viewer.addHandler("open", () => {
  const item = viewer.world.getItemAt(0);
  item.whenFullyLoaded(() => requestAnimationFrame(() => requestAnimationFrame(() => { document.title = "loaded"; })));
});
viewer.addHandler("open-failed", (event) => { document.title = "failed: " + event.message; });
</script></body></html>"""


class Handler(SimpleHTTPRequestHandler):
    """Serves a folder, and keeps the requests that failed."""

    failed: list[str] = []  # noqa: RUF012 — one list for all requests

    def log_message(self, *arguments: object) -> None:
        pass

    def send_error(self, code: int, *arguments: object) -> None:
        self.failed.append(f"{code} {self.path}")
        super().send_error(code)


def test_every_page_is_shown_as_it_is(browser: Browser, volume: Volume, tmp_path: Path) -> None:
    root = tmp_path / "web"
    root.mkdir()
    Handler.failed.clear()
    with local_server(partial(Handler, directory=str(root))) as address:
        deliver(volume, Format.IIIF, root / "volume", address=f"{address}/volume", now=NOW)
        (root / "openseadragon.min.js").write_bytes((PAGE / "vendor/openseadragon/openseadragon.min.js").read_bytes())
        manifest = json.loads((root / "volume/manifest.json").read_text())
        bodies = [canvas["items"][0]["items"][0]["body"] for canvas in manifest["items"]]
        assert len(bodies) == 2
        for number, body in enumerate(bodies, 1):
            (root / "view.html").write_text(VIEW.replace("SERVICE", json.dumps(body["service"][0]["id"])))
            shown = screen(browser, f"{address}/view.html")
            assert correlation(shown, picture(number)) > LIKE
            assert correlation(shown, picture(3 - number)) < OTHER
    assert [line for line in Handler.failed if "favicon" not in line] == []


def screen(browser: Browser, address: str) -> np.ndarray:
    """What the window shows once every tile is there, (h, w) grey."""
    page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
    page.goto(address)
    page.wait_for_function("document.title !== ''")
    assert page.title() == "loaded"
    shot = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("L"))
    page.close()
    return shot


def correlation(shown: np.ndarray, image: np.ndarray) -> float:
    """Of a window's picture with an image that it shows whole, in its middle."""
    height, width = image.shape[:2]
    scale = min(SIZE[0] / width, SIZE[1] / height)
    size = round(width * scale), round(height * scale)
    grey = cv2.resize(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), size, interpolation=cv2.INTER_AREA)
    top, left = (SIZE[1] - size[1]) // 2, (SIZE[0] - size[0]) // 2
    part = shown[top : top + size[1], left : left + size[0]]
    return float(np.corrcoef(part.ravel(), grey.ravel())[0, 1])
