"""The stations of a body from its model and its reduction."""

from __future__ import annotations

from collections import Counter
from typing import Literal

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.second_order import SHARE, mass_share
from modalprep.body.stations.record import OutsideBasis, Stations, mean_turns
from modalprep.body.stations.second_order import mass_growth
from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.division.masses import part_masses
from modalprep.fe.division.parts import divide
from modalprep.fe.links.interface import InterfaceFrame
from modalprep.linalg.blas import inner
from modalprep.linalg.sparse import times
from modalprep.reduction.basis import Reduction
from modalprep.reduction.derivatives import LeftOut

STATIONS = "stations"  # key of the provenance


def with_stations(
    body: FlexibleBody,
    model: FEModel,
    reduction: Reduction,
    parts: int,
    second_order_mass: bool | Literal["auto"],
    low: np.ndarray,
    idle_below: float = 0.0,
) -> FlexibleBody:
    """Return the body with stations; `low (k, n, n)` are the first rows of T, from `stiffness_and_growth`.

    The stations have the second order of the modal mass of what bends as lines do; its provenance says how much more
    the body has, where that is much.

    Raises
    ------
    InputError
        When the mesh closes on itself, or T is asked for, which a body of stations does not have.
    """
    if second_order_mass is True:
        raise InputError(
            "second_order_mass = true has no place in a body with large_deflection, whose stations bend the masses "
            'along; leave it at "auto"'
        )
    if not body.n:
        raise InputError("large_deflection needs a body with modes; keep some, or set large_deflection = false")
    body = body.with_(stations=build_stations(model, reduction, parts).with_(idle_below=idle_below))
    assert body.stations is not None
    said = f"large deflections by {len(body.stations)} stations along the ways from the root"
    if len(low):
        share = mass_share(body, low, mass_growth(body)[: len(low)])
        if share > SHARE:
            said += (
                "; the second order of the modal mass beyond them, which is left out, would shift squared frequencies "
                f"of the lowest modes by {100 * share:.0f} % of what geometric stiffness does: more stations leave less"
            )
    return body.with_(provenance={STATIONS: said, **body.provenance})


def build_stations(model: FEModel, reduction: Reduction, parts: int) -> Stations:
    """Divide a model into about so many parts along each way from its root, and integrate over them.

    Raises
    ------
    InputError
        When the mesh closes on itself, or mass belongs to no element.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.craig_bampton import craig_bampton
    >>> model = cantilever_model()
    >>> build_stations(model, craig_bampton(model, modes=2), 5)
    Stations(5 parts, 1 ends)
    """
    division = divide(model, parts)
    n = len(reduction.frequency)
    left_out = reduction.left_out
    vectors = reduction.basis if left_out is None else np.hstack([reduction.basis, left_out.vectors])
    found = part_masses(model, division.of_element, vectors)
    light = np.flatnonzero(found.m <= 0)
    if len(light):
        raise InputError(
            f"large_deflection: part {light[0] + 1} of {len(found.m)} has no mass, as its elements have no density; "
            "give them one, or take fewer stations"
        )
    centre = found.s / found.m[:, None]
    E = found.E - found.m[:, None, None] * centre[:, :, None] * centre[:, None]
    H = found.H - found.S[:, :, None] * centre[:, None, :, None]
    owner = [-1, *(_owner(model, frame, division.of_node) for frame in model.interfaces[1:])]
    stations = Stations(
        parent=division.parent,
        m=found.m,
        centre=centre,
        E=E,
        S=found.S[..., :n],
        H=H[..., :n],
        owner=np.array(owner),
        part=division.of_node[: len(model.points)],
    )
    if left_out is None:
        return stations
    return stations.with_(outside=_outside(model, reduction.basis, left_out, stations, found.S[..., n:], H[..., n:]))


def _outside(
    model: FEModel, basis: np.ndarray, left_out: LeftOut, stations: Stations, S: np.ndarray, H: np.ndarray
) -> OutsideBasis:
    """Return what the derivatives that are left out, with integrals S and H over the parts, do to the stations."""
    at_interfaces = left_out.vectors[np.array([frame.dofs for frame in model.interfaces])]
    at_interfaces[0] = 0.0
    return OutsideBasis(
        shapes=inner(left_out.shapes, times(model.K, basis)),
        products=left_out.products,
        moved=S / stations.m[:, None, None],
        turned=mean_turns(stations.J, H),
        phi=at_interfaces[:, :3],
        psi=at_interfaces[:, 3:],
    )


def _owner(model: FEModel, frame: InterfaceFrame, of_node: np.ndarray) -> int:
    """Return the part that owns most nodes of an interface; the farther one of two."""
    nodes = frame.nodes if len(frame.nodes) else np.flatnonzero(model.dof[:, 0] == frame.dofs[0])
    count = Counter(of_node[nodes[of_node[nodes] >= 0]].tolist())
    if not count:
        raise InputError(f"large_deflection: interface {frame.name!r} has no node of an element")
    return max(count, key=lambda part: (count[part], part))
