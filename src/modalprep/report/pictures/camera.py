"""The camera of a plotter: what it sees fills the picture."""

from __future__ import annotations

import numpy as np

FRAME = (0.05, 0.13, 0.93, 0.88)  # left, bottom, right, top of the picture that the body may fill


def look(plotter, seen: np.ndarray, towards: np.ndarray, up: np.ndarray) -> None:
    """Point the camera of a plotter at the points ``seen (n, 3)`` from the unit vector `towards`, with `up` (3,)."""
    right = np.cross(up, towards)
    across, along = seen @ right, seen @ up
    height, shift = _fit(np.ptp(across), np.ptp(along), plotter.window_size[0] / plotter.window_size[1])
    middle = (across.max() + across.min()) / 2 * right + (along.max() + along.min()) / 2 * up
    focus = middle + shift @ np.array([right, up]) + (seen @ towards).mean() * towards
    plotter.camera_position = [focus + 10 * height * towards, focus, up]
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = height / 2
    plotter.reset_camera_clipping_range()


def _fit(width: float, height: float, aspect: float) -> tuple[float, np.ndarray]:
    """Return the height of the picture and the offset (right, up) from the body's centre to that of the picture."""
    left, bottom, right, top = FRAME
    tall = max(height / (top - bottom), width / (right - left) / aspect) or 1.0
    return tall, -tall * np.array([aspect * ((left + right) / 2 - 0.5), (bottom + top) / 2 - 0.5])
