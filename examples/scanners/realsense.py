"""A RealSense depth camera as a scanner.

`python realsense.py shot.npz [FRAMES]` captures, `--status` prints its name.

Needs the package pyrealsense2. The depths of several frames are averaged, and shown in the colour camera's view.
"""

from __future__ import annotations

import sys

import numpy as np
import pyrealsense2 as rs

METRE_MM = 1000.0
WARM_UP = 15  # frames until the exposure has settled


def status() -> str:
    """The name and the serial number of the first camera."""
    for camera in rs.context().query_devices():
        return f"{camera.get_info(rs.camera_info.name)} {camera.get_info(rs.camera_info.serial_number)}"
    sys.exit("no RealSense camera is connected")


def capture(frames: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (rows, cols, 3) mm, 0 where not measured; colours (rows, cols, 3) uint8."""
    pipeline, cloud, align = rs.pipeline(), rs.pointcloud(), rs.align(rs.stream.color)
    config = rs.config()
    config.enable_stream(rs.stream.depth, rs.format.z16)
    config.enable_stream(rs.stream.color, rs.format.rgb8)
    pipeline.start(config)
    try:
        for _ in range(WARM_UP):
            pipeline.wait_for_frames()
        total = count = 0.0
        for number in range(frames):
            print(f"progress {number / frames} frame {number + 1}", flush=True)
            aligned = align.process(pipeline.wait_for_frames())
            colour = aligned.get_color_frame()
            points = cloud.calculate(aligned.get_depth_frame())
            shape = colour.get_height(), colour.get_width(), 3
            vertices = np.asanyarray(points.get_vertices()).view(np.float32).reshape(shape)
            total, count = total + vertices, count + (vertices[..., 2:] > 0)
        return METRE_MM * total / np.maximum(count, 1), np.asanyarray(colour.get_data()).copy()
    finally:
        pipeline.stop()


def main(output: str, frames: int = 1) -> None:
    """Capture and save a scan."""
    points, colours = capture(frames)
    np.savez(output, points=points.astype(np.float32), colours=colours)


if __name__ == "__main__":
    if sys.argv[1] == "--status":
        print(status())
    else:
        main(sys.argv[1], *map(int, sys.argv[2:]))
