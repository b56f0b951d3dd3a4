"""MIX 2.0: the technical metadata of a still image (ANSI/NISO Z39.87-2006)."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from fractions import Fraction
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from PIL import Image, ImageCms

from restore import BadInput
from station.archive.volume import StoredFile
from station.archive.xml import MIX, element, optional

INCH_UNIT = "in."
SCHEMES = {"PNG": "Deflate", "TIFF": "Deflate", "JPEG": "JPEG"}  # of the files that Planish writes


@dataclass(frozen=True)
class ImageFacts:
    """Facts of an image file.

    Format, size in pixels, bits and samples, dots to the inch (0: unknown).
    """

    format: str
    width: int
    height: int
    bits: tuple[int, ...]
    colours: str
    dpi: float
    profile: str


def read_image_facts(path: Path) -> ImageFacts:
    """Return the facts of an image file, from its header.

    Raises BadInput when it is not an image, OSError when the disk refuses.
    """
    try:
        with path.open("rb") as file, Image.open(file) as image:
            dpi = float(image.info.get("dpi", (0.0,))[0])
            profile = image.info.get("icc_profile")
            bands = len(image.getbands())
            colours = {1: "WhiteIsZero" if image.mode == "1" else "BlackIsZero", 3: "RGB"}.get(bands, image.mode)
            palette = "PaletteColor" if image.mode == "P" else colours
            return ImageFacts(
                str(image.format), image.width, image.height, (8,) * bands, palette, dpi, _profile_name(profile)
            )
    except (OSError, ValueError, SyntaxError) as error:
        if isinstance(error, OSError) and error.errno is not None:  # what Pillow finds wrong with a file has none
            raise
        raise BadInput(f"{path} is not an image: {error}", "derive it again from its scan") from error


def encode_mix(file: StoredFile, facts: ImageFacts, provenance: Mapping[str, Any]) -> Element:
    """The metadata of an image. provenance: of the scan that it was made from."""
    return element(
        f"{MIX}mix",
        element(
            f"{MIX}BasicDigitalObjectInformation",
            element(
                f"{MIX}ObjectIdentifier",
                element(f"{MIX}objectIdentifierType", "local"),
                element(f"{MIX}objectIdentifierValue", file.name),
            ),
            element(f"{MIX}fileSize", file.size),
            element(f"{MIX}FormatDesignation", element(f"{MIX}formatName", file.media_type)),
            element(f"{MIX}Compression", element(f"{MIX}compressionScheme", SCHEMES.get(facts.format, "unknown"))),
            element(
                f"{MIX}Fixity",
                element(f"{MIX}messageDigestAlgorithm", "SHA-512"),
                element(f"{MIX}messageDigest", file.sha512),
            ),
        ),
        element(
            f"{MIX}BasicImageInformation",
            element(
                f"{MIX}BasicImageCharacteristics",
                element(f"{MIX}imageWidth", facts.width),
                element(f"{MIX}imageHeight", facts.height),
                element(f"{MIX}PhotometricInterpretation", element(f"{MIX}colorSpace", facts.colours), _icc(facts)),
            ),
        ),
        _capture(provenance),
        element(
            f"{MIX}ImageAssessmentMetadata",
            _sampling(facts.dpi),
            element(
                f"{MIX}ImageColorEncoding",
                element(
                    f"{MIX}BitsPerSample",
                    [element(f"{MIX}bitsPerSampleValue", bits) for bits in facts.bits],
                    element(f"{MIX}bitsPerSampleUnit", "integer"),
                ),
                element(f"{MIX}samplesPerPixel", len(facts.bits)),
            ),
        ),
    )


def _icc(facts: ImageFacts) -> Element | None:
    if not facts.profile:
        return None
    name = element(f"{MIX}IccProfile", element(f"{MIX}iccProfileName", facts.profile))
    return element(f"{MIX}ColorProfile", name)


def _capture(provenance: Mapping[str, Any]) -> Element | None:
    device, time = provenance.get("device"), _time(provenance.get("time"))
    if not device:
        return None
    return element(
        f"{MIX}ImageCaptureMetadata",
        element(
            f"{MIX}GeneralCaptureInformation",
            optional(f"{MIX}dateTimeCreated", time),
            element(f"{MIX}captureDevice", "reflection print scanner"),
        ),
        element(
            f"{MIX}ScannerCapture",
            element(f"{MIX}ScannerModel", element(f"{MIX}scannerModelName", str(device))),
            element(f"{MIX}scannerSensor", "undefined"),
        ),
    )


def _time(value: Any) -> str | None:
    """Return a time in the notation of XML Schema, None for other texts.

    Other programs write times in any form.
    """
    try:
        return datetime.fromisoformat(value).isoformat()
    except (TypeError, ValueError):
        return None


def _sampling(dpi: float) -> Element | None:
    """Return samples to the inch of the paper itself.

    It is the plane of the object, not that of the sensor.
    """
    if dpi <= 1:  # what Pillow gives for a file without a unit
        return None
    ratio = Fraction(dpi).limit_denominator(10_000)
    return element(
        f"{MIX}SpatialMetrics",
        element(f"{MIX}samplingFrequencyPlane", "source object plane"),
        element(f"{MIX}samplingFrequencyUnit", INCH_UNIT),
        *(
            element(
                f"{MIX}{axis}SamplingFrequency",
                element(f"{MIX}numerator", ratio.numerator),
                element(f"{MIX}denominator", ratio.denominator),
            )
            for axis in ("x", "y")
        ),
    )


def _profile_name(profile: bytes | None) -> str:
    """Return the description of an ICC profile, empty without a readable one."""
    if profile is None:
        return ""
    try:
        return ImageCms.getProfileDescription(io.BytesIO(profile)).strip()
    except ImageCms.PyCMSError:
        return ""
