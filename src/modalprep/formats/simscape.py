"""Simscape Multibody: the data of its block Reduced Order Flexible Solid."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import scipy

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.formats.nastran import superelement
from modalprep.formats.refusals import with_suffix

HEAD = b"MATLAB 5.0 MAT-file, written by modalprep"  # 116 characters, in place of the time of writing


def write_simscape(body: FlexibleBody, path: str | Path) -> Path:
    """Write a body for the block Reduced Order Flexible Solid of Simscape Multibody as a MAT file.

    ``origins`` (n_f, 3) and ``orientations`` (n_f, 4, quaternions w, x, y, z) of the interface frames; ``stiffness``,
    ``mass`` and ``damping`` in the coordinates (x, y, z, rotations about them) of each frame, then of the modes with
    all of them clamped; ``interfaces`` their names. SI units, frame B. Interfaces that the modes do not move in all six
    ways have no frame.

    Lost: all that is not linear, but what the block makes of large rotations itself.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the body has no modes, its frame is not that of its root, or the name does not end in ``.mat``.

    References
    ----------
    MathWorks, Simscape Multibody: Reduced Order Flexible Solid.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> file = write_simscape(uniform_beam(modes=6, truncation=("interfaces",)), Path(tempfile.mkdtemp()) / "beam.mat")
    >>> scipy.io.loadmat(file)["origins"]
    array([[ 0.,  0.,  0.],
           [10.,  0.,  0.]])
    """
    path = with_suffix(path, "a body of Simscape", ".mat")
    whole = superelement(body)
    frames = list(whole.physical)
    data = {
        "origins": body.interface_position[frames],
        "orientations": np.tile([1.0, 0, 0, 0], (len(frames), 1)),
        "stiffness": whole.K,
        "mass": whole.M,
        "damping": whole.D,
        "interfaces": np.array([body.interface_name[k] for k in frames], dtype=object),
    }
    with atomic_path(path) as temporary:
        file = io.BytesIO()
        scipy.io.savemat(file, data)
        temporary.write_bytes(HEAD.ljust(116) + file.getvalue()[116:])
    return path
