"""What is to be recovered from a model, and its preparation (theory 4.9)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

from modalprep.applies import Rule, refuse_idle
from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.mesh.select import NodeSet
from modalprep.fe.recovery.fields import Piece, Quantity, chosen
from modalprep.fe.recovery.lines import section_forces, spring_forces
from modalprep.fe.recovery.links import link_forces
from modalprep.fe.recovery.nodes import accelerations, cut_forces, displacements, interface_reactions, node_forces
from modalprep.fe.recovery.surfaces import resultants, stress
from modalprep.suggest import refuse_unknown

RecoveryKind = Literal[
    "section_force", "force", "mpc_force", "resultant", "stress", "reaction", "cut", "acceleration", "displacement"
]
KINDS = get_args(RecoveryKind)
OF_METHOD = tuple(kind for kind in KINDS if kind != "acceleration")  # by mode displacement or mode acceleration
NAMED = ("acceleration", "displacement", "cut")  # kinds that need nodes or elements
Method = Literal["acceleration", "displacement"]
Vector = tuple[float, float, float]
AT_NODES = {"acceleration": accelerations, "displacement": displacements, "reaction": node_forces}


@dataclass(frozen=True, kw_only=True, repr=False)
class Recover(NodeSet):
    """A quantity to recover, of the elements of a mesh group, or of those within a node set, or of nodes.

    Attributes
    ----------
    kind : str
        ``section_force`` of beams and trusses, ``force`` of springs, ``mpc_force`` of links, ties and supports on each
        of their nodes, ``resultant`` of shells, ``stress`` of solids (at nodes) or shells (both faces of each element),
        ``reaction`` of the fixed interfaces, or of nodes with supports or links where nodes are given, ``cut`` through
        which the other elements hold these, ``acceleration`` of nodes, or their ``displacement``.
    method : {"acceleration", "displacement"}
        Mode acceleration adds the static response of the dropped modes and the inertia between the nodes; mode
        displacement has the modes alone.
    stations : int
        Section forces: places along each element, both ends included.
    axis : (3,) or None
        Shells: its projection is x of the components; None takes x of the mesh.
    allowable : float or None
        Largest allowed value, of von Mises stress or of the magnitude of each component, for margins.

    Raises
    ------
    InputError
        When kind or method is unknown, or nodes are given in several ways.

    References
    ----------
    Theory 4.9.

    Examples
    --------
    >>> Recover(kind="section_force", group="strut")
    section_force of group 'strut'
    """

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("stations",), needs=("kind",), among=("section_force",)),
        Rule(("axis",), needs=("kind",), among=("resultant", "stress")),
        Rule(("method",), needs=("kind",), among=OF_METHOD, advice="accelerations have one"),
    )
    kind: RecoveryKind
    method: Method = "acceleration"
    stations: int = 2
    axis: Vector | None = None
    allowable: float | None = None

    def __post_init__(self) -> None:
        """Refuse unknown words; no nodes at all are all of them."""
        refuse_unknown(self.kind, KINDS, "recovery: kind")
        refuse_unknown(self.method, get_args(Method), "recovery: method")
        refuse_idle(self)
        if self._given():
            super().__post_init__()
        elif self.kind in NAMED:
            raise InputError(
                f"a recovery of kind {self.kind!r} needs nodes or elements; give group, box, near or others"
            )

    @property
    def _where(self) -> NodeSet | None:
        """The node set; None for the whole model."""
        return NodeSet(**{name: getattr(self, name) for name in self._given()}) if self._given() else None

    def quantity(self, model: FEModel, mesh: Mesh) -> Quantity:
        """Prepare the recovery from a model and the mesh from which it was assembled.

        Returns
        -------
        Quantity
            A linear map from fields over the model's DOFs.
        """
        where = self._where
        if self.kind == "mpc_force":
            return link_forces(model, mesh, where)
        if self.kind == "reaction" and where is None:
            return interface_reactions(model)
        if self.kind in AT_NODES and where is not None:
            return AT_NODES[self.kind](model, mesh, where)
        return self._of_elements(model, mesh, chosen(model, mesh, where))

    def _of_elements(self, model: FEModel, mesh: Mesh, pieces: list[Piece]) -> Quantity:
        match self.kind:
            case "section_force":
                return section_forces(pieces, self.stations)
            case "force":
                return spring_forces(model, pieces)
            case "resultant":
                return resultants(pieces, self.axis)
            case "stress":
                return stress(model, mesh, pieces, self.axis)
            case _:
                return cut_forces(model, pieces)

    def __repr__(self) -> str:
        """Kind and nodes."""
        return f"{self.kind} of {super().__repr__() if self._given() else 'the whole model'}"


@dataclass(frozen=True, eq=False)
class ModelRecovery:
    """Recoveries that are prepared for a model.

    Attributes
    ----------
    wanted : {name: Recover}
    quantities : {name: Quantity}
    """

    wanted: Mapping[str, Recover]
    quantities: Mapping[str, Quantity]


def model_recovery(model: FEModel, mesh: Mesh, wanted: Mapping[str, Recover]) -> ModelRecovery:
    """Prepare recoveries of a model.

    Parameters
    ----------
    model : FEModel
    mesh : Mesh
        From which the model was assembled.
    wanted : {name: Recover}

    Returns
    -------
    ModelRecovery
        For `flexible_body`.

    Raises
    ------
    InputError
        When a group is unknown, or has no elements or nodes of the kind.

    References
    ----------
    Theory 4.9.

    Examples
    --------
    >>> import numpy as np
    >>> from modalprep.examples import beam_mesh, cantilever_model
    >>> from modalprep.fe.recovery.fields import Fields
    >>> model = cantilever_model(elements=2)
    >>> found = model_recovery(model, beam_mesh(2), {"beam": Recover(kind="section_force", group="beam")})
    >>> pull = np.zeros((model.n_dof, 1))
    >>> pull[model.dof[:, 0], 0] = 0.0, 1e-3, 2e-3  # strain 2e-4 on EA = 2.8e7 N
    >>> found.quantities["beam"].places, found.quantities["beam"].values(Fields.static(pull))[:, 0].round(6).ravel()
    (('1.start', '1.end', '2.start', '2.end'), array([5600., 5600., 5600., 5600.]))
    """
    quantities = {}
    for name, each in wanted.items():
        if not name or {"/", "."} & set(name):
            raise InputError(f"recovery {name!r} cannot be the name of channels; leave '.' and '/' out")
        try:
            quantities[name] = each.quantity(model, mesh)
        except InputError as error:
            raise InputError(f"recovery {name!r}: {error}") from None
    return ModelRecovery(dict(wanted), quantities)
