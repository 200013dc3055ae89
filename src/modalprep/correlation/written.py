"""Modes of a test, measured or synthetic, as a universal file, by pyuff."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.correlation.mode_set import ModeSet
from modalprep.errors import InputError

FIRST_SYSTEM = 2  # number of the first coordinate system: 0 and 1 often mean the frame of the file
REAL, TRANSLATIONS, DISPLACEMENT = 2, 2, 8  # codes of dataset 55
SI = {"units_code": 1, "units_description": "SI", "temp_mode": 1, "length": 1.0, "force": 1.0, "temp": 1.0}


def write_test_modes(test: ModeSet, path: str | Path) -> Path:
    """Write datasets 164 (units), 2420 and 15 (places and axes of the sensors), 82 (trace lines) and 55 (modes).

    Parameters
    ----------
    test : ModeSet
        Real modes; components that were not measured are written as zero, as `read_test_modes` reads them.
    path : str or Path
        Usually ``.uff`` or ``.unv``.

    Returns
    -------
    Path
        The file; it has five digits of places, six of shapes and frequencies.

    Raises
    ------
    InputError
        When the modes are complex, or two sensors have one number.

    References
    ----------
    Universal file datasets 15, 55, 82, 164, 2420 (University of Cincinnati, Structural Dynamics Research Lab).

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.correlation import body_modes, choose_sensors, read_test_modes, synthetic_test
    >>> from modalprep.examples import uniform_beam
    >>> modes = body_modes(uniform_beam(modes=4))
    >>> test = synthetic_test(modes, choose_sensors(modes, 12), noise=0.02)
    >>> found = read_test_modes(write_test_modes(test, Path(tempfile.mkdtemp()) / "test.uff"))
    >>> int(found.measured.sum()), found.frequency.round(4).tolist() == modes.frequency.round(4).tolist()
    (12, True)
    """
    import pyuff

    if np.iscomplexobj(test.shape):
        raise InputError(f"{test.name}: complex modes are not written; take their real part by real()")
    if len(np.unique(test.labels)) < len(test.labels):
        raise InputError(f"{test.name}: two sensors have one number; give each its own")
    sets = [{"type": 164, **SI, "temp_offset": 273.15}, *_places(test), *_traces(test)]
    with atomic_path(path) as temporary:
        pyuff.UFF(str(temporary)).write_sets([*sets, *(_mode(test, k) for k in range(test.n))], "overwrite")
    return Path(path)


def _places(test: ModeSet) -> list[dict[str, Any]]:
    """Return the coordinate systems of the components, and the nodes."""
    zero = np.zeros(len(test.points), dtype=int)
    number = zero
    systems = []
    if test.axes is not None:
        different, which = np.unique(test.axes.round(12).reshape(-1, 9), axis=0, return_inverse=True)
        number = FIRST_SYSTEM + which.ravel()
        labels = [FIRST_SYSTEM + k for k in range(len(different))]
        systems = [
            {
                "type": 2420,
                "Part_UID": 1,
                "Part_Name": "sensors",
                "CS_sys_labels": labels,
                "CS_types": [0] * len(labels),
                "CS_colors": [8] * len(labels),
                "CS_names": [f"axes {k}" for k in labels],
                "CS_matrices": [np.vstack([row.reshape(3, 3), np.zeros(3)]) for row in different],
            }
        ]
    x, y, z = test.points.T
    nodes = {"type": 15, "node_nums": test.labels, "def_cs": zero, "disp_cs": number, "color": zero + 1}
    return [*systems, nodes | {"x": x, "y": y, "z": z}]


def _traces(test: ModeSet) -> list[dict[str, Any]]:
    return [
        {"type": 82, "trace_num": k, "n_nodes": 2, "color": 1, "id": "trace", "nodes": test.labels[pair]}
        for k, pair in enumerate(test.lines, start=1)
    ]


def _mode(test: ModeSet, k: int) -> dict[str, Any]:
    shape = np.nan_to_num(test.shape[:, :, k])
    damping = float(np.nan_to_num(test.damping[k]))
    return {
        "type": 55,
        "id1": test.name[:80],
        "id2": "modes of a test",
        "id3": "NONE",
        "id4": f"mode {k + 1}",
        "id5": "NONE",
        "model_type": 1,
        "analysis_type": 2,
        "data_ch": TRANSLATIONS,
        "spec_data_type": DISPLACEMENT,
        "data_type": REAL,
        "n_data_per_node": 3,
        "load_case": 1,
        "mode_n": k + 1,
        "freq": float(test.frequency[k]),
        "modal_m": 0.0,
        "modal_damp_vis": damping,
        "modal_damp_his": 0.0,
        "node_nums": test.labels,
        "r1": shape[:, 0],
        "r2": shape[:, 1],
        "r3": shape[:, 2],
    }
