"""A page converted from its camera's colours to sRGB (ICC.1:2010)."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
from PIL import Image, ImageCms

from restore import BadInput, RestoredPage
from restore.scan import Bytes
from station.images.icc import srgb_profile


def convert_to_srgb(page: RestoredPage, profile: bytes) -> RestoredPage:
    """Convert the image of a page from an ICC profile to sRGB.

    The master keeps its codes. Raises BadInput for a profile that cannot be used.
    """
    converted, name = image_to_srgb(page.image, profile)
    image = np.where(page.mask[..., None], converted, page.image)
    page = page.with_pictures(image=image)
    return replace(page, report={**page.report, "white_balance": {"setting": "profile", "icc_profile": name}})


def image_to_srgb(image: Bytes, profile: bytes) -> tuple[Bytes, str]:
    """Convert an image from an ICC profile to sRGB, by relative colorimetry.

    The profile of a chart maps the chart's greys to neutral: the colour of the lamp that the chart was captured in, and
    the level of its light, are removed.
    image: (h, w, 3) uint8.
    Returns the image and the profile's name. Raises BadInput for a profile that cannot be used.
    """
    try:
        camera, srgb = (ImageCms.ImageCmsProfile(io.BytesIO(data)) for data in (profile, srgb_profile()))
        intent = ImageCms.Intent.RELATIVE_COLORIMETRIC
        transform = ImageCms.buildTransform(camera, srgb, "RGB", "RGB", intent, ImageCms.Flags.NOOPTIMIZE)
        name = ImageCms.getProfileDescription(camera).strip()
    except (OSError, ImageCms.PyCMSError) as error:
        raise BadInput(
            f"the colour profile cannot be used: {error}", "give a file that `planish colour` wrote"
        ) from error
    converted = ImageCms.applyTransform(Image.fromarray(image), transform)
    assert converted is not None  # which only a conversion in place returns
    return np.asarray(converted), name
