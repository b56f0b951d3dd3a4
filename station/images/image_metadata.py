"""Metadata of images in ICC, EXIF and XMP: profile, device, lens, time, software."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import PackageNotFoundError, version
from typing import Any
from xml.etree import ElementTree

from PIL import ExifTags, Image

from station.images.icc import srgb_profile

# XMP specification part 1, 7 and part 2, 8; exifEX from CIPA DC-010 (Exif metadata for XMP).
NAMESPACES = {
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
class ImageMetadata:
    """profile: ICC; device, lens, time: None where the provenance of the scan has none."""

    profile: bytes
    software: str
    device: str | None = None
    lens: str | None = None
    time: datetime | None = None

    @classmethod
    def from_provenance(cls, provenance: Mapping[str, Any], profile: bytes | None = None) -> ImageMetadata:
        """Metadata of a shot from its provenance. profile: sRGB when None."""
        device, lens = (str(provenance[key]) if key in provenance else None for key in ("device", "lens"))
        return cls(profile or srgb_profile(), software(), device, lens, _time(provenance.get("time")))

    def xmp(self) -> bytes:
        """An XMP packet."""
        for prefix, space in NAMESPACES.items():
            ElementTree.register_namespace(prefix, space)
        meta = ElementTree.Element(f"{{{NAMESPACES['x']}}}xmpmeta")
        rdf = ElementTree.SubElement(meta, f"{{{NAMESPACES['rdf']}}}RDF")
        about = ElementTree.SubElement(
            rdf, f"{{{NAMESPACES['rdf']}}}Description", {f"{{{NAMESPACES['rdf']}}}about": ""}
        )
        fields: dict[tuple[str, str], str | None] = {
            ("xmp", "CreatorTool"): self.software,
            ("xmp", "CreateDate"): None if self.time is None else self.time.isoformat(),
            ("tiff", "Model"): self.device,
            ("exifEX", "LensModel"): self.lens,
        }
        for (prefix, name), value in fields.items():
            if value is not None:
                ElementTree.SubElement(about, f"{{{NAMESPACES[prefix]}}}{name}").text = value
        return PACKET.format(ElementTree.tostring(meta, encoding="unicode")).encode("utf-8")

    def exif(self) -> bytes:
        """The EXIF block of PNG and JPEG."""
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
    """A time in the notation of EXIF and TIFF."""
    return time.strftime("%Y:%m:%d %H:%M:%S")


def _time(value: Any) -> datetime | None:
    try:
        return datetime.fromisoformat(value)
    except (TypeError, ValueError):  # other programs write times in any form
        return None
