"""A 3D camera that speaks GenICam, such as Photoneo's, as a scanner.

`python genicam.py shot.npz SERIAL` captures, `--status` prints its name.

Needs the package harvesters. The environment variable GENICAM_PRODUCER names the maker's GenTL producer, a .cti file.
Features and their values are those of the GenICam standard (SFNC 2.7), and Photoneo's output mode of a grid.
"""

from __future__ import annotations

import os
import sys
from contextlib import contextmanager

import numpy as np
from harvesters.core import Harvester

LEVELS = {"Mono8": 255, "Mono10": 1023, "Mono12": 4095, "Mono16": 65535}
WAIT_S = 30.0


@contextmanager
def harvester():
    """The cameras that the producer finds."""
    with Harvester() as found:
        found.add_file(os.environ["GENICAM_PRODUCER"])
        found.update()
        yield found


def status() -> str:
    """The model and the serial number of the first camera."""
    with harvester() as found:
        for camera in found.device_info_list:
            return f"{camera.model} {camera.serial_number}"
    sys.exit("no GenICam camera is connected")


def prepare(features) -> None:
    """One shot of points and intensities when it is triggered."""
    features.TriggerSelector.value, features.TriggerMode.value = "FrameStart", "On"
    features.TriggerSource.value = "Software"
    features.Scan3dOutputMode.value = "CalibratedABC_Grid"
    for name in features.ComponentSelector.symbolics:
        features.ComponentSelector.value = name
        features.ComponentEnable.value = name in ("Intensity", "Range")


def colours_of(component) -> np.ndarray:
    """Colours (rows, cols, 3) uint8 of an intensity image."""
    if component.data_format == "RGB8":
        return component.data.reshape(component.height, component.width, 3).copy()
    grey = component.data.reshape(component.height, component.width, 1) * (255.0 / LEVELS[component.data_format])
    return np.repeat(grey.astype(np.uint8), 3, axis=2)


def main(output: str, serial: str) -> None:
    """Capture and save a scan: points (rows, cols, 3) mm, 0 where nothing was measured."""
    with harvester() as found, found.create({"serial_number": serial}) as camera:
        features = camera.remote_device.node_map
        prepare(features)
        camera.start()
        print("progress 0.2 projecting", flush=True)
        features.TriggerSoftware.execute()
        with camera.fetch(timeout=WAIT_S) as buffer:
            parts = buffer.payload.components
            (cloud,) = (one for one in parts if one.data_format.startswith("Coord3D_ABC"))
            (picture,) = (one for one in parts if not one.data_format.startswith("Coord3D"))
            points = cloud.data.reshape(cloud.height, cloud.width, 3)
            np.savez(output, points=points.astype(np.float32), colours=colours_of(picture))


if __name__ == "__main__":
    if sys.argv[1] == "--status":
        print(status())
    else:
        main(*sys.argv[1:])
