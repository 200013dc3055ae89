"""Exudyn: the data of an ``ObjectFFRFreducedOrder`` as an NPZ file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.fe.mesh.facets import boundary, corners, of_dimension
from modalprep.formats.contractions import inertia, moment
from modalprep.formats.nodes import refuse_other_modal_mass
from modalprep.formats.refusals import refuse_without_modes, with_suffix
from modalprep.vectors import skew

ROTATION = "NodeType.RotationEulerParameters"
ARM = 0.05  # of the body's size: distance from an interface to the six nodes that represent its rotation


def write_exudyn(body: FlexibleBody, path: str | Path) -> Path:
    """Write a body for Exudyn; the file is written completely or not at all.

    ``ObjectFFRFreducedOrderInterface().LoadFromFile(path, mode="NPZ")`` reads it, ``AddObjectFFRFreducedOrder`` puts
    it in a system. The floating frame is frame B of `FlexibleBody`. Root-clamped modes do not move its origin: a
    joint at the root is a joint of the rigid body node (``MarkerNodeRigid``) without further reference conditions, and
    the equations are those of theory 4 with Kg = 0. In another frame (frames.py) the root, too, is
    reached through its six nodes.

    Nodes, in this order: the mesh (`body.points`), then six for each interface, at `ARM` body sizes along the axes of
    B on both sides of it. They carry the translation and rotation of the interface and no mass; a
    ``MarkerSuperElementRigid`` with these six nodes and equal weights is the interface. Two keys that Exudyn does not
    read name them: ``interfaceNames`` (n_if,) and ``interfaceNodes`` (n_if, 6).

    The file holds one pickled object, the empty dictionary ``postProcessingModes`` that Exudyn expects: ``np.load``
    needs ``allow_pickle=True``, as Exudyn itself gives.

    Lost: the geometric stiffness (not available in Exudyn: a rapidly rotating body softens instead of stiffening, as
    `FlexibleBody.conventional` does here), damping (give it to ``AddObjectFFRFreducedOrder``) and stresses. Rotary
    inertia of beams and shells is kept, because the integrals come from the body and not from its nodes. Exudyn's own
    gravity load acts at the undeformed centre of mass: where the deflection matters, add the torque ``(A S q) x g`` on
    the rigid body node (A its rotation matrix, S ``mPhitTPsi``).

    Parameters
    ----------
    body : FlexibleBody
    path : str or Path
        Must end in ``.npz``.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the body has no modes, the name does not end in ``.npz``, or the folder cannot be written.

    References
    ----------
    J. Gerstmayr, Exudyn - a C++-based Python package for flexible multibody systems, Multibody Syst. Dyn. 60 (2024)
    533.
    Theory 4.4.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> file = write_exudyn(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.npz")
    >>> with np.load(file) as data:
    ...     data["modeBasis"].shape, float(data["totalMass"])
    ((159, 2), 12.0)
    """
    refuse_without_modes(body, "for Exudyn", "make it an ObjectRigidBody there")
    refuse_other_modal_mass(body)
    path = with_suffix(path, "a body of Exudyn", ".npz")
    arrays: dict[str, Any] = {**_nodes(body), **inertia_blocks(body), **_header(body)}
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, **arrays)
    return path


def _header(body: FlexibleBody) -> dict[str, object]:
    nodes = len(body.points) + 6 * len(body.interface_name)
    return {
        "fileVersion": 1,
        "type": "ObjectFFRFreducedOrderInterface",
        "infoList": np.array([body.n, nodes, 3, 4, 7, 7 + body.n]),
        "rigidBodyNodeType": ROTATION,
        "postProcessingModes": np.array({}, dtype=object),
        "massMatrixReduced": np.eye(body.n),
        "stiffnessMatrixReduced": np.diag(body.K),
        "trigList": surface_triangles(body.cells),
        "interfaceNames": np.array(body.interface_name),
        "interfaceNodes": len(body.points) + np.arange(6 * len(body.interface_name)).reshape(-1, 6),
    }


def _nodes(body: FlexibleBody) -> dict[str, np.ndarray]:
    """Positions and modes of the mesh and of six nodes around each interface."""
    size = np.ptp(np.concatenate([body.points, body.interface_position]), axis=0).max()
    arms = ARM * (size or 1.0) * np.concatenate([np.eye(3), -np.eye(3)])
    turned = skew(body.psi.transpose(0, 2, 1)) @ arms.T  # (n_if, n, 3, 6)
    around = body.interface_position[:, None] + arms
    moved = body.phi[:, None] + turned.transpose(0, 3, 2, 1)
    return {
        "xRef": np.concatenate([body.points, around.reshape(-1, 3)]).ravel(),
        "modeBasis": np.concatenate([body.shape, moved.reshape(-1, 3, body.n)]).reshape(-1, body.n),
    }


def inertia_blocks(body: FlexibleBody) -> dict[str, np.ndarray]:
    """Return the inertia blocks of the nodal floating-frame formulation, as contractions of the modal integrals.

    With ``x~``, ``psi_j~`` the skew matrices of position and mode and ``sum m`` the sum over the mass, from
    ``a~^T b~ = (a.b) I - b a^T``. Blocks of three, one per mode, are mode-major: ``3 k + c``.

    Returns
    -------
    dict of array
        ``Mtt (3, 3)``, ``totalMass``, ``chiU (3,)`` the centre of mass, ``chiUtilde (3, 3)``,
        ``inertiaLocal (3, 3) = sum m x~^T x~``, ``mPhitTPsi (3, n) = sum m psi``,
        ``mPhitTPsiTilde (3, 3n) = sum m psi~``, ``mXRefTildePsi (3, n) = sum m x~^T psi``,
        ``mXRefTildePsiTilde (3, 3n) = sum m x~^T psi~``, ``mPsiTildePsi (3n, n) = sum m psi~^T psi``,
        ``mPsiTildePsiTilde (3n, 3n) = sum m psi~^T psi~``.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> inertia_blocks(uniform_beam(modes=2))["chiU"]
    array([5., 0., 0.])
    """
    n = body.n
    centre = body.s0 / body.m
    return {
        "Mtt": body.m * np.eye(3),
        "totalMass": np.array(body.m),
        "chiU": centre,
        "chiUtilde": skew(centre),
        "inertiaLocal": inertia(body.E0),
        "mPhitTPsi": body.S,
        "mPhitTPsiTilde": skew(body.S.T).transpose(1, 0, 2).reshape(3, 3 * n),
        "mXRefTildePsi": -moment(body.H),
        "mXRefTildePsiTilde": inertia(body.H).transpose(0, 2, 1).reshape(3, 3 * n),
        "mPsiTildePsi": -moment(body.P).transpose(2, 0, 1).reshape(3 * n, n),
        "mPsiTildePsiTilde": inertia(body.P).transpose(3, 0, 2, 1).reshape(3 * n, 3 * n),
    }


def surface_triangles(cells: dict[str, np.ndarray]) -> np.ndarray:
    """Return the triangles ``(t, 3)`` of all shells and of the free faces of solids, through their corners.

    Examples
    --------
    >>> surface_triangles({"tetra": np.array([[0, 1, 2, 3], [1, 2, 3, 4]])}).shape  # the face between is not seen
    (6, 3)
    """
    skin = boundary(of_dimension(cells, 3))
    faces = corners([*of_dimension(cells, 2), *skin.items()])
    quads = faces[faces[:, 2] != faces[:, 3]]
    return np.concatenate([faces[:, :3], quads[:, [0, 2, 3]]])
