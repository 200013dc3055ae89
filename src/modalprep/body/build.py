"""From a reduction to the modal body: modal integrals and geometric stiffness, theory 4."""

from __future__ import annotations

from typing import Literal

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.quality.mode_names import Moving, mode_names
from modalprep.body.quality.resolution import coarse_mesh
from modalprep.body.quality.units import implausible_units
from modalprep.body.recovery_matrices import recovery_matrices
from modalprep.body.second_order import SECOND_ORDER, stiffness_and_growth, with_second_order_mass
from modalprep.body.stations.build import STATIONS, with_stations
from modalprep.body.stations.recoveries import refuse_far_recoveries
from modalprep.body.stress import StressModes
from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.assembly.stress_recovery import StressRecovery
from modalprep.fe.recovery.recover import ModelRecovery
from modalprep.linalg.blas import inner, one_numpy_thread
from modalprep.linalg.sparse import times
from modalprep.reduction.basis import Reduction
from modalprep.reduction.dampers import coupling_note, damping_fields
from modalprep.suggest import refuse_other
from modalprep.verdicts.notes import told


@told
@one_numpy_thread(beside_mkl=True)
def flexible_body(
    model: FEModel,
    reduction: Reduction,
    *,
    name: str,
    damping: float = 0.0,
    stress: StressRecovery | None = None,
    recovery: ModelRecovery | None = None,
    second_order_mass: bool | Literal["auto"] = "auto",
    stations: int = 0,
    idle_below: float = 0.0,
    provenance: dict[str, str] | None = None,
) -> FlexibleBody:
    """Project a model on its reduced basis.

    Parameters
    ----------
    model, reduction
        The reduction must be of this model.
    name : str
    damping : float
        Modal damping ratio (fraction of critical) of every mode.
    stress : StressRecovery
        Points with stress modes, from `stress_recovery` on this model.
    recovery : ModelRecovery
        Quantities with recovery matrices, from `model_recovery` on this model.
    second_order_mass : bool or "auto"
        Whether the body has T, the second order of its modal mass (second_order.py); "auto" takes it where it matters,
        and the provenance says how much.
    stations : int
        Parts along each way from the root, for deflections up to the body's length (theory 4.10); 0: the modes alone
        move the body, to about a tenth of its size.
    idle_below : float
        Of the body's size: runs and equilibria leave the stations out where the modes alone move the body as they do to
        that. A body that cannot have stations is built without them then, and its notes say why. 0: never.
    provenance : dict of str
        Added to the source of the mesh.

    Returns
    -------
    FlexibleBody
        In SI units, its frame at the root interface and parallel to the axes of the mesh.

    Raises
    ------
    InputError
        When the damping is negative or the basis belongs to another model.

    Warns
    -----
    ModalprepWarning
        Of a size, mass or frequency that suggests a wrong unit.

    References
    ----------
    Theory 4.1 and 4.2.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=2)
    >>> body.Kg_W[0, 0].shape, bool(abs(body.Kg_W[0, 0]).max() > 1)
    ((2, 2), True)
    """
    refuse_other("flexible_body: the model", FEModel, model)
    refuse_other("flexible_body: the reduction", Reduction, reduction)
    if not 0 <= idle_below < 1:
        raise InputError(f"flexible_body: idle_below = {idle_below:g} must be at least 0 and below 1, of the size")
    if damping < 0:
        raise InputError(f"damping = {damping:g} must not be negative; it is a fraction of critical")
    Phi = reduction.basis
    if len(Phi) != model.n_dof:
        raise InputError(f"the reduction has {len(Phi)} DOFs but the model {model.n_dof}; reduce this model")
    Kg, low = stiffness_and_growth(model, reduction, second_order_mass)
    body = _body(model, reduction, Kg, name, damping, provenance or {}).with_(
        stress=_stress_modes(stress, Phi, reduction.frequency > 0) if stress else {},
        recovery=recovery_matrices(model, reduction, recovery) if recovery else {},
    )
    refused: tuple[str, ...] = ()
    if stations:
        try:
            refuse_far_recoveries(recovery)
            body = with_stations(body, model, reduction, stations, second_order_mass, low, idle_below)
        except InputError as error:
            if not idle_below:
                raise
            refused = (f"without stations, so that the modes alone move the body: {error}",)
    if body.stations is None:
        body = with_second_order_mass(body, model, reduction, second_order_mass, low)
    said = [text for key, text in body.provenance.items() if key in (SECOND_ORDER, STATIONS)]
    said += coupling_note(body.coupled_damping)
    own = (*refused, *said, *implausible_units(body, model.scale), *coarse_mesh(model, Phi, body))
    return body.with_(notes=(*model.notes, *reduction.notes, *own), mode_names=_mode_names(model, body))


def _body(
    model: FEModel, reduction: Reduction, Kg: np.ndarray, name: str, damping: float, provenance: dict[str, str]
) -> FlexibleBody:
    """Return the body of theory 4.1; ``Kg (12 + 6 k, n, n)`` is by accelerations, spins, loads of k interfaces."""
    Phi = reduction.basis
    n = Phi.shape[1]
    w = 2 * np.pi * reduction.frequency
    dampers = None if model.damping is None else inner(Phi, times(model.damping, Phi))
    Kg_if = Kg[12:].reshape(len(model.interfaces), 6, n, n)
    at_interfaces = Phi[np.array([frame.dofs for frame in model.interfaces])]
    at_interfaces[0] = 0.0
    return FlexibleBody(
        name=name,
        m=model.rigid.m,
        s0=model.rigid.s0,
        E0=model.rigid.E0,
        S=np.ascontiguousarray(inner(model.g, Phi)),
        H=inner(model.h.reshape(-1, 9), Phi).reshape(3, 3, n),
        P=model.M_ab.project(Phi),
        Kg_A=Kg[:3],
        Kg_W=Kg[3:12].reshape(3, 3, n, n),
        Kg_F=Kg_if[:, :3],
        Kg_T=Kg_if[:, 3:],
        phi=at_interfaces[:, :3],
        psi=at_interfaces[:, 3:],
        K=w**2,
        **damping_fields(2 * damping * w, dampers),
        frequency=reduction.frequency,
        interface_name=tuple(frame.name for frame in model.interfaces),
        interface_position=np.array([frame.position for frame in model.interfaces]),
        points=model.points,
        cells=model.cells,
        shape=nodal_shape(model, Phi),
        modes=reduction.table,
        truncation=reduction.truncation,
        energy=_strain_energy(model, Phi, reduction.frequency > 0),
        volume=model.strain_energy.volume() if model.strain_energy else {},
        provenance={**model.source, **provenance},
    )


def _mode_names(model: FEModel, body: FlexibleBody) -> tuple[str, ...]:
    """Name the modes by the masses of the nodes, and by the groups of the elements where they are known."""
    dof = model.dof[: len(model.points), :3]
    mass = np.abs(np.where(dof >= 0, model.g[dof, np.arange(3)], 0.0)).mean(axis=1)
    used = mass > 0
    parts: dict[str, np.ndarray] = {}
    for part in model.elements.parts if model.elements else ():
        parts.setdefault(part.group, np.zeros(len(mass), dtype=bool))[part.nodes[part.nodes < len(mass)]] = True
    strain = {}
    if model.groups is not None and body.energy:
        share = model.groups.summed(body.energy) / np.where(body.K > 0, body.K / 2, np.inf)
        strain = dict(zip(model.groups.names, share, strict=True))
    parts = {name: nodes[used] for name, nodes in parts.items()}
    return mode_names(Moving(model.points[used], body.shape[used], mass[used], parts, strain))


def _strain_energy(model: FEModel, Phi: np.ndarray, strained: np.ndarray) -> dict[str, np.ndarray]:
    """Return the strain energy of the cells, zero for rigid-body modes."""
    found = model.strain_energy(Phi) if model.strain_energy else {}
    return {kind: np.where(strained, energy, 0) for kind, energy in found.items()}


def _stress_modes(recovery: StressRecovery, Phi: np.ndarray, strained: np.ndarray) -> dict[str, StressModes]:
    """Return the stress at the points, zero for rigid-body modes."""
    found = {name: StressModes(**at._asdict()) for name, at in recovery(Phi).items()}
    return {name: at.with_(modes=np.where(strained, at.modes, 0)) for name, at in found.items()}


def nodal_shape(model: FEModel, Phi: np.ndarray) -> np.ndarray:
    """Return the translations ``(n_points, 3, n)`` of the mesh nodes per modal coordinate; 0 at unused nodes.

    A view of ``Phi (n_dof, n)`` where every node has its three translations and no rotation, as in solids.
    """
    dof = model.dof[: len(model.points)]
    if np.array_equal(dof[:, :3], np.arange(3 * len(dof)).reshape(-1, 3)):
        return Phi[: 3 * len(dof)].reshape(len(dof), 3, Phi.shape[1])
    shape = Phi[dof[:, :3]]
    shape[dof[:, :3] < 0] = 0.0
    return shape
