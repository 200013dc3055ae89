"""Assembly of a mesh and its properties to the finite-element model (theory 1)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import get_args

import numpy as np
from scipy.sparse import csr_array
from skfem import asm

from modalprep.errors import InputError
from modalprep.fe.assembly.beam_arms import with_beam_arms, with_joined_offsets
from modalprep.fe.assembly.damping import damping_matrix
from modalprep.fe.assembly.forms import FORMS, FormsName
from modalprep.fe.assembly.free_faces import with_free_faces
from modalprep.fe.assembly.group_energy import Groups
from modalprep.fe.assembly.link_stiffness import LinkStiffness
from modalprep.fe.assembly.matrix_elements import MatrixSum, matrix_nodes, sum_matrices
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.assembly.offset_area import offset_areas
from modalprep.fe.assembly.parts import Elements, Part, find_parts, refuse_disconnected, used_nodes
from modalprep.fe.assembly.placing import Placed, place
from modalprep.fe.assembly.rotating_mass import RotatingMass
from modalprep.fe.assembly.rotation_continuity import hidden_hinges
from modalprep.fe.assembly.slight_mass import with_slight_mass
from modalprep.fe.assembly.sparsity import diagonal_of
from modalprep.fe.assembly.strain_energy import StrainEnergy
from modalprep.fe.assembly.structure import Structure
from modalprep.fe.assembly.structure_forms import ModelForms
from modalprep.fe.elements.distribution import Distribution, MassRule
from modalprep.fe.links.constraints import constrain
from modalprep.fe.links.interface import Connection, Interface, connect, interface_position
from modalprep.fe.links.support import Support, held_nodes
from modalprep.fe.mesh.left_out import explained
from modalprep.fe.mesh.mesh import Mesh, refuse_far_points
from modalprep.fe.properties.plausible import implausible_sections
from modalprep.fe.properties.points import PointMass, impossible_masses
from modalprep.fe.properties.properties import Property
from modalprep.fe.terms.added import AnyTerm, held_by_terms, with_terms
from modalprep.fe.terms.term import Term
from modalprep.suggest import refuse_other, refuse_unknown
from modalprep.verdicts.notes import told


@told
@explained
def assemble(
    mesh: Mesh,
    properties: Mapping[str, Property],
    interfaces: Mapping[str, Interface],
    root: str | None = None,
    connections: Mapping[str, Connection] | None = None,
    supports: Mapping[str, Support] | None = None,
    mass: Distribution = "coupled",
    terms: Mapping[str, AnyTerm] | None = None,
    forms: FormsName = "compiled",
) -> FEModel:
    """Assemble the finite-element model of a mesh.

    Parameters
    ----------
    mesh : Mesh
    properties : {group: Beam, Truss, Shell, Solid, PointMass or Spring}
        Every structural cell needs exactly one; those that the mesh file carries need not be repeated.
    interfaces : {name: Interface}
        At least one.
    root : str
        The interface at which the body frame sits; default the first.
    connections : {name: Connection}
        New nodes tied to node sets; each creates a group of its name.
    supports : {name: Support}
        Components of nodes that are held at the frame of the root. Those of the mesh file are used only where one of
        these names them (``Support(set=...)``).
    mass : {"coupled", "lumped", "nastran"}
        Consistent mass of the elements; all mass at the nodes; or as MSC Nastran distributes it, lumped unless the
        deck has ``PARAM,COUPMASS,1``.
    terms : {name: Foundation, AddedMass or fe.Term}
        What is added to the elements.
    forms : {"compiled", "plain"}
        Compiled loops over the elements, or the weak forms of scikit-fem (theory 7), which are their reference
        implementation: the same matrices to rounding, in 10 to 70 times the time.

    Returns
    -------
    FEModel
        In a frame at the root interface with the axes of the mesh, SI units.

    Raises
    ------
    InputError
        When a group or root is unknown, a cell has no property or two, an element is degenerate,
        an interface node has no rotations, two links or supports drive one node, or the structure is in several parts.

    References
    ----------
    Theory 1; of the elements theory 7.

    Examples
    --------
    >>> from modalprep.examples import beam_mesh, spinup_section
    >>> model = assemble(beam_mesh(4), {"beam": spinup_section()}, {"root": Interface(group="root", kind="node")})
    >>> model
    FEModel(5 nodes, 30 DOFs, m=12 kg; interfaces root)
    >>> bool(abs(model.K @ model.rigid_body()).max() < 1e-6 * abs(model.K).max())
    True
    """
    refuse_other("assemble: the mesh", Mesh, mesh)
    refuse_unknown(str(mass), get_args(Distribution), "assemble: mass")
    refuse_unknown(str(forms), get_args(FormsName), "assemble: forms")
    refuse_far_points(mesh.points, mesh.labels, "mesh")
    order = root_first(interfaces, root)
    connections = dict(connections or {})
    for name in set(connections) & set(mesh.groups):
        raise InputError(f"connection {name!r} has the name of a mesh group; choose another")
    sections = {**mesh.properties, **properties}
    supports = dict(supports or {})
    added = {name: term if isinstance(term, Term) else term.term() for name, term in (terms or {}).items()}
    boundary = {spec.group for spec in (*interfaces.values(), *connections.values(), *supports.values()) if spec.group}
    known = {name: section for name, section in sections.items() if name not in connections}
    mesh = connect(mesh, connections, _used(mesh, find_parts(mesh, known, boundary)[0]))
    parts, notes = find_parts(mesh, sections, boundary)
    held = held_nodes(mesh, supports, _with_dofs(mesh, parts))
    grounded = [*(support.nodes for support in held.values()), held_by_terms(mesh, added)]
    nodes = {name: _interface_nodes(mesh, name, interfaces[name], grounded, parts, name == order[0]) for name in order}
    at = {name: interface_position(mesh, name, interfaces[name], nodes[name]) for name in order}
    refuse_disconnected(mesh.points, parts, _tied(mesh, interfaces, nodes, grounded, order[0]), _used(mesh, parts))
    parts, unheld = with_free_faces(with_beam_arms(mesh, with_joined_offsets(mesh, parts)))
    parts, more = _without_unused_inertia(mesh, parts)
    tips = np.array([at[0] for name, at in nodes.items() if interfaces[name].kind == "node"], dtype=int)
    dof = _number(mesh, parts, sum(spec.kind != "node" for spec in interfaces.values()), tips)
    matrices = sum_matrices(mesh, dof, at[order[0]])
    placed = place(mesh, interfaces, nodes, at, dof, held)
    more += [*unheld, *placed.notes, *hidden_hinges(mesh, parts), *offset_areas(mesh, parts), *_odd_units(mesh, parts)]
    rule = MassRule(mass, mesh.coupled_mass)
    if sum(spec.boundary == "fixed" for spec in interfaces.values()) > 1:
        parts = with_slight_mass(parts, rule, mesh.points)
    structure = Structure(parts, mesh.points, dof, rule, at[order[0]])
    more += mesh.cyclic.notes if mesh.cyclic else ()
    more += matrices.notes if matrices else ()
    model = _sum(mesh, structure, FORMS[forms], matrices, at[order[0]], placed, (*mesh.notes, *notes, *more))
    return with_terms(model, mesh, added)


def _used(mesh: Mesh, parts: list[Part]) -> np.ndarray:
    """Return the nodes of elements and matrices."""
    return np.union1d(used_nodes(parts), matrix_nodes(mesh))


def _with_dofs(mesh: Mesh, parts: list[Part]) -> np.ndarray:
    """Return the nodes of elements, and those that links or equations bring, such as the frames of couplings."""
    found = np.zeros(len(mesh.points), dtype=bool)
    found[_used(mesh, parts)] = True
    found[[link.node for link in mesh.links]] = True
    for equation in mesh.equations:
        found[equation.nodes] = True
    return np.flatnonzero(found)


def _interface_nodes(mesh, name, spec: Interface, grounded: list[np.ndarray], parts, root: bool) -> np.ndarray:
    """Return the nodes of an interface; one of kind support has those of all supports and foundations."""
    if spec.kind != "support":
        return spec.nodes(mesh, _used(mesh, parts))
    held = np.unique(np.concatenate(grounded))
    if not root:
        raise InputError(f"interface {name!r} is of kind 'support', which only the root interface can be")
    if not len(held):
        raise InputError(
            f"interface {name!r} is of kind 'support', which needs supports or a foundation; name what holds the model"
        )
    return held


def _tied(mesh: Mesh, interfaces, nodes: dict[str, np.ndarray], held: list[np.ndarray], root: str):
    """Return the node sets that interfaces, links, equations, matrices, supports and foundations connect."""
    framed = [at for name, at in nodes.items() if interfaces[name].kind != "node"]
    links = [np.append(link.nodes, link.node) for link in mesh.links]
    joining = [own.nodes for own in (*mesh.equations, *mesh.matrices)]
    return framed + links + joining + [np.concatenate([nodes[root], *held])]


def _odd_units(mesh: Mesh, parts: list[Part]) -> list[str]:
    size = float(np.ptp(mesh.points[used_nodes(parts)], axis=0).max())
    sections = {part.group: part.section for part in parts}
    return [*implausible_sections(sections, size), *impossible_masses(sections)]


def root_first(interfaces: Mapping[str, Interface], root: str | None) -> list[str]:
    """Return the names of the interfaces, the root (default the first) before the others."""
    names = list(interfaces)
    if not names:
        raise InputError("the model has no interface; name at least one under [interfaces] to carry the body frame")
    root = names[0] if root is None else root
    if root not in names:
        raise InputError(f"root {root!r} is not an interface; known are {', '.join(names)}")
    return [root, *(name for name in names if name != root)]


def _sum(
    mesh, structure: Structure, forms: ModelForms, matrices: MatrixSum | None, origin, placed: Placed, notes
) -> FEModel:
    """Assemble the forms of the model over its elements, and add the matrices of the mesh."""
    K = asm(forms.stiffness, structure)
    M = asm(forms.mass, structure)
    g, h = forms.linear(structure)
    M_ab, rigid = forms.mass_tensor(structure), forms.rigid(structure)
    if matrices:
        K, M, g, h = K + matrices.K, M + matrices.M, g + matrices.g, h + matrices.h
        M_ab, rigid = M_ab + matrices.M_ab, rigid + matrices.rigid
    constraints = constrain(placed.links, len(g), placed.equations, placed.kept)
    diagonal = abs(diagonal_of(K)) + abs(diagonal_of(M))
    C, free = without_unused_dofs(constraints.C, constraints.free, diagonal, placed.frames)
    links = LinkStiffness(K, constraints)
    inertias, dof = structure.inertias, structure.dofmap.dof
    groups, kinds = zip(*((part.group, part.kind) for part, _ in structure.pieces), strict=True)
    return FEModel(
        points=structure.dofmap.points,
        cells=_cells(structure.parts),
        dof=dof,
        K=K,
        M=M,
        g=g,
        h=h,
        M_ab=M_ab,
        rigid=rigid,
        C=C,
        free=free,
        interfaces=placed.frames,
        geometric_stiffness=forms.prestress(structure, links),
        rotating_mass=RotatingMass(inertias, dof),
        strain_energy=StrainEnergy(list(kinds), structure.blocks, dof),
        groups=Groups(list(groups), list(kinds), inertias, structure.masses, dof),
        elements=Elements(tuple(structure.parts), structure.rule),
        damping=damping_matrix(structure),
        origin=origin,
        terms=matrices.term if matrices else {},
        source={"mesh": mesh.source, "mesh_sha256": mesh.sha256},
        notes=(*notes, *constraints.notes),
        scale=mesh.scale,
    )


def _without_unused_inertia(mesh: Mesh, parts: list[Part]) -> tuple[list[Part], list[str]]:
    """Drop the inertia and offset of masses on nodes without rotations, such as those of solids."""
    turning = np.zeros(len(mesh.points), dtype=bool)
    for part in parts:
        if not isinstance(part.section, PointMass) and part.components(mesh.points) == 6:
            turning[part.nodes] = True
    for link in mesh.links:
        turning[link.node] = True
        turning[link.nodes] |= link.kind == "rbe2" and bool(link.components[..., 3:].any())
    for equation in mesh.equations:
        turning[equation.nodes[equation.coefficients[:, 3:].any(axis=1)]] = True
    for own in mesh.matrices:
        turning[own.rows[own.rows[:, 1] > 2, 0]] = True
    kept, notes = [], []
    for part in parts:
        section = part.section
        if isinstance(section, PointMass) and not np.all(turning[part.nodes]) and part.components(mesh.points) == 6:
            notes.append(f"mass {part.group!r} sits on a node without rotations: its inertia and offset are left out")
            part = Part(part.group, PointMass(mass=section.mass), part.kind, part.nodes, part.data)
        kept.append(part)
    return kept, notes


def _number(mesh: Mesh, parts: list[Part], frames: int, tips: np.ndarray) -> np.ndarray:
    """Number the DOFs node by node, 3 or 6 each; every interface that is not a node adds one of six.

    Of `tips`, the nodes that are interfaces, those have six too that a rigid link turns.
    """
    width = np.zeros(len(mesh.points) + frames, dtype=int)
    width[len(mesh.points) :] = 6
    for part in parts:
        np.maximum.at(width, part.nodes, part.components(mesh.points))
    width[[link.node for link in mesh.links]] = 6
    for link in mesh.links:
        if link.kind == "rbe2":
            width[link.nodes[np.isin(link.nodes, tips) & link.components[..., 3:].all(axis=-1)]] = 6
    for equation in mesh.equations:
        np.maximum.at(width, equation.nodes, 3 + 3 * equation.coefficients[:, 3:].any(axis=1))
    for own in mesh.matrices:
        np.maximum.at(width, own.rows[:, 0], 3 + 3 * (own.rows[:, 1] > 2))
    active = np.arange(6) < width[:, None]
    return np.where(active, np.cumsum(active).reshape(active.shape) - 1, -1)


def without_unused_dofs(C, free, diagonal, frames) -> tuple[csr_array, np.ndarray]:
    """Leave out independent DOFs that have neither stiffness nor mass, such as unused rotations.

    `diagonal (n_dof,)` is the sum of the absolute diagonals of K and M.
    """
    share = np.repeat(diagonal, np.diff(C.indptr)) * C.data**2
    idle = np.bincount(C.indices, share, C.shape[1]) == 0
    idle[np.searchsorted(free, np.concatenate([frame.dofs for frame in frames]))] = False
    return (C[:, np.flatnonzero(~idle)].tocsr(), free[~idle]) if idle.any() else (C, free)


def _cells(parts: list[Part]) -> dict[str, np.ndarray]:
    cells: dict[str, list] = {}
    for part in parts:
        cells.setdefault(part.kind, []).append(part.nodes)
    return {kind: np.concatenate(c) for kind, c in cells.items()}
