"""What a picture's file tells of its making: colours, device, lens, time, software (as ICC, EXIF and XMP)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import PackageNotFoundError, version
from typing import Any
from xml.etree import ElementTree

from PIL import ExifTags, Image

from station.export.icc import srgb_profile

# XMP specification part 1, 7 and part 2, 8; exifEX from CIPA DC-010 (Exif metadata for XMP).
SPACES = {
    "x": "adobe:ns:meta/",
    "rdf": "http://www.w3.org/1999/02/22-rdf-syntax-ns#",
    "xmp": "http://ns.adobe.com/xap/1.0/",
    "tiff": "http://ns.adobe.com/tiff/1.0/",
    "exifEX": "http://cipa.jp/exif/1.0/",
}
PACKET = '<?xpacket begin="\ufeff" id="W5M0MpCehiHzreSzNTczkc9d"?>\n{}\n<?xpacket end="r"?>'


def software() -> str:
    """This program and its version."""
    try:
        return f"planish {version('planish')}"
    except PackageNotFoundError:
        return "planish"


@dataclass(frozen=True)
class Stamp:
    """profile: ICC; device, lens, time: None where the scan does not tell them."""

    profile: bytes
    software: str
    device: str | None = None
    lens: str | None = None
    time: datetime | None = None

    @classmethod
    def of(cls, provenance: Mapping[str, Any], profile: bytes | None = None) -> Stamp:
        """From what is known of a shot. profile: sRGB when None."""
        device, lens = (str(provenance[key]) if key in provenance else None for key in ("device", "lens"))
        return cls(profile or srgb_profile(), software(), device, lens, _time(provenance.get("time")))

    def xmp(self) -> bytes:
        """An XMP packet."""
        for prefix, space in SPACES.items():
            ElementTree.register_namespace(prefix, space)
        meta = ElementTree.Element(f"{{{SPACES['x']}}}xmpmeta")
        rdf = ElementTree.SubElement(meta, f"{{{SPACES['rdf']}}}RDF")
        about = ElementTree.SubElement(rdf, f"{{{SPACES['rdf']}}}Description", {f"{{{SPACES['rdf']}}}about": ""})
        told: dict[tuple[str, str], str | None] = {
            ("xmp", "CreatorTool"): self.software,
            ("xmp", "CreateDate"): None if self.time is None else self.time.isoformat(),
            ("tiff", "Model"): self.device,
            ("exifEX", "LensModel"): self.lens,
        }
        for (prefix, name), value in told.items():
            if value is not None:
                ElementTree.SubElement(about, f"{{{SPACES[prefix]}}}{name}").text = value
        return PACKET.format(ElementTree.tostring(meta, encoding="unicode")).encode("utf-8")

    def exif(self) -> bytes:
        """EXIF, as PNG and JPEG carry it."""
        exif = Image.Exif()
        exif[ExifTags.Base.Software] = self.software
        if self.device is not None:
            exif[ExifTags.Base.Model] = self.device
        details = exif.get_ifd(ExifTags.IFD.Exif)
        if self.lens is not None:
            details[ExifTags.Base.LensModel] = self.lens
        if self.time is not None:
            details[ExifTags.Base.DateTimeOriginal] = exif_time(self.time)
            if self.time.tzinfo is not None:
                details[ExifTags.Base.OffsetTimeOriginal] = self.time.isoformat()[-6:]
        return exif.tobytes()


def exif_time(time: datetime) -> str:
    """A time as EXIF and TIFF write it."""
    return time.strftime("%Y:%m:%d %H:%M:%S")


def _time(told: Any) -> datetime | None:
    try:
        return datetime.fromisoformat(told)
    except (TypeError, ValueError):  # a scan of others may tell its time in any form
        return None
