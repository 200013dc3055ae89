"""Files of pictures, written completely or not at all."""

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
    """Write the picture of a plotter and close it; the file is written completely or not at all."""
    try:
        return write_shot(plotter, path)
    finally:
        plotter.close()


def write_shot(plotter, path: str | Path) -> Path:
    """Write the picture of a plotter, which can draw others then."""
    refuse_suffix(path)
    return save_image(shot(plotter), path)


def save_image(image: np.ndarray, path: str | Path) -> Path:
    """Write a picture (height, width, 3); the file is written completely or not at all."""
    from PIL import Image

    refuse_suffix(path)
    with atomic_path(Path(path)) as temporary:
        Image.fromarray(image).save(temporary)
    return Path(path)


def refuse_suffix(path: str | Path) -> None:
    """Refuse a file that is no picture."""
    if Path(path).suffix.lower() not in PICTURES:
        raise InputError(f"cannot write {path}: a picture is one of {', '.join(PICTURES)}")
