"""From a plotter to a picture: its pixels, its file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.errors import InputError

PICTURES = (".png", ".jpg", ".jpeg")


def shot(plotter) -> np.ndarray:
    """Return the picture (height, width, 3) of all that a plotter holds, drawn once."""
    plotter.render()  # of the first picture nothing: `screenshot` draws that itself
    return np.array(plotter.screenshot(return_img=True))


def save_picture(plotter, path: str | Path) -> Path:
    """Write a picture as `write_shot` does, and close the plotter."""
    try:
        return write_shot(plotter, path)
    finally:
        plotter.close()


def write_shot(plotter, path: str | Path) -> Path:
    """Write the picture of all that a plotter holds; the file is written completely or not at all."""
    from PIL import Image

    path = Path(path)
    if path.suffix.lower() not in PICTURES:
        raise InputError(f"cannot write {path}: a picture is one of {', '.join(PICTURES)}")
    image = Image.fromarray(shot(plotter))
    with atomic_path(path) as temporary:
        image.save(temporary)
    return path
