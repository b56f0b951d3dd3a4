"""A Zivid camera as a scanner.

`python zivid_camera.py shot.npz [SETTINGS.yml]` captures, `--status` prints its name.

Needs the package zivid and Zivid's SDK. SETTINGS.yml is exported from Zivid Studio, with 2D settings for the colours.
"""

from __future__ import annotations

import sys

import numpy as np
import zivid


def status() -> str:
    """The name and the serial number of the first camera."""
    for camera in zivid.Application().cameras():
        return f"{camera.info.model_name} {camera.info.serial_number}"
    sys.exit("no Zivid camera is connected")


def settings_of(path: str | None) -> zivid.Settings:
    """The settings of a file, or one acquisition for points and colours."""
    if path is not None:
        return zivid.Settings.load(path)
    colour = zivid.Settings2D(acquisitions=[zivid.Settings2D.Acquisition()])
    return zivid.Settings(acquisitions=[zivid.Settings.Acquisition()], color=colour)


def main(output: str, settings: str | None = None) -> None:
    """Capture and save a scan: points (rows, cols, 3) mm, NaN where nothing was measured."""
    print("progress 0.1 connecting", flush=True)
    with zivid.Application() as application, application.connect_camera() as camera:
        print("progress 0.3 projecting", flush=True)
        with camera.capture_2d_3d(settings_of(settings)) as frame:
            cloud = frame.point_cloud()
            np.savez(output, points=cloud.copy_data("xyz"), colours=cloud.copy_data("rgba")[..., :3])


if __name__ == "__main__":
    if sys.argv[1] == "--status":
        print(status())
    else:
        main(*sys.argv[1:])
