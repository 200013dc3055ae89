"""SID_FEM: the Standard Input Data of flexible bodies (Wallrapp 1994), for FEMBS, PY_SID, FEMBeam, EMBSlib and PyMbs.

The equation of motion of its readers, first order in q, with ``wq = (wx^2, wy^2, wz^2, wx wy, wy wz, wz wx)``::

    m a     + ~mdCM^T w'  + Ct^T q'' + 2 w~ Ct^T q' + w~ w~ mdCM             = F
    ~mdCM a + J w'        + Cr^T q'' + sum_j Gr_j q'_j w + w~ J w            = T
    Ct a    + Cr w'       + Me q''   + sum_j Ge_j q'_j w + Oe wq + Ke q + De q' = sum phi^T f + psi^T t

with ``a`` less gravity and every matrix ``X = M0 + sum_k M1[:, k, :] q_k``. Against theory 4 it lacks the
second order of ``mdCM`` and ``J`` and the first of ``Gr`` and of the Coriolis ``Ct``; the modal row is complete.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.formats.contractions import centrifugal, inertia, moment
from modalprep.formats.nodes import Node, export_nodes
from modalprep.records import Record
from modalprep.suggest import refuse_unknown
from modalprep.vectors import skew

VALUE_COLUMN = 48  # of '=', in every FEMBS file seen
COMMENT_LENGTH = 150  # of the first line; FEMBS stays below 200 characters


@dataclass(frozen=True, eq=False, kw_only=True)
class Taylor(Record):
    """A matrix ``M0 (rows, columns)`` and its derivative ``M1 (rows, n, columns)``, None where constant."""

    M0: np.ndarray
    M1: np.ndarray | None = None
    symmetric: bool = False

    @property
    def structure(self) -> int:
        """0 zero, 2 symmetric, 3 full."""
        if not np.any(self.M0) and (self.M1 is None or not np.any(self.M1)):
            return 0
        return 2 if self.symmetric else 3


@dataclass(frozen=True)
class Dialect:
    """Differences between the programs that write the format."""

    header: str
    number: Callable[[float], str]
    gr_by_axis: bool  # columns of Gr and Ge: all modes of x, of y, of z; else x, y, z of each mode
    ge_by_axis: bool
    mode_last: bool  # m1(row, column, mode) instead of m1(row, mode, column)
    inertia_matrix: bool  # J as 3 x 3 instead of xx, yy, zz, xy, xz, yz
    named: bool = True  # EMBSlib looks for the names of blocks, such as J, in the body's name too


def _fortran(value: float) -> str:
    return f"{value:18.11E}".replace("E", "D")


def _plain(value: float) -> str:
    return f"{value:24.16E}"


_FEMBS_HEADER = "{nodes:5d} {modes:3d}    :No. nodes, No. modes:{comment}"
DIALECTS = {
    "fembs": Dialect(_FEMBS_HEADER, _fortran, True, True, False, False),
    "pysid": Dialect(_FEMBS_HEADER, _fortran, False, True, False, False),
    "embs": Dialect(_FEMBS_HEADER, _fortran, False, False, False, False, named=False),
    "fembeam": Dialect("{nodes} nodes, {modes} modes, {comment}", _plain, False, False, True, True),
}


def write_sid(body: FlexibleBody, path: str | Path, dialect: str = "fembs", mesh_nodes: Sequence[int] = ()) -> Path:
    """Write a body as SID_FEM; the file is written completely or not at all.

    Its nodes are numbered from 1: the interfaces in their order, then the mesh nodes, which have no rotation.

    Parameters
    ----------
    dialect : {"fembs", "pysid", "embs", "fembeam"}
        Program whose layout of ``Gr, Ge, J``, index order and number format is used; ``embs`` is what EMBSlib and PyMbs
        read.
    mesh_nodes : sequence of int
        Further nodes, rows of ``body.points`` from 0.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the dialect is unknown, a node does not exist, the body has no modes or the folder cannot be written.

    References
    ----------
    O. Wallrapp, Standardization of flexible body modeling in multibody system codes, part I: definition of standard
    input data, Mech. Struct. Mach. 22 (1994) 283.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> file = write_sid(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.sid_fem")
    >>> print(file.read_text().splitlines()[0])
        2   2    :No. nodes, No. modes:beam by modalprep, SI units; nodes 1 root, 2 tip
    """
    refuse_unknown(dialect, DIALECTS, "SID dialect")
    nodes = export_nodes(body, mesh_nodes)
    lines = _lines(body, nodes, DIALECTS[dialect])
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="ascii", errors="replace")
    return Path(path)


def body_terms(body: FlexibleBody, dialect: Dialect) -> dict[str, Taylor]:
    """Return the matrices of the body in the order of the file.

    ``H, P`` give the inertial part; the geometric stiffness enters by the work of the second-order displacement:
    ``Kg_A`` in Ct, the antisymmetric combination of ``Kg_W`` in Cr, the symmetric one in Oe.
    """
    field = body.P + body.Kg_W
    by_row = (1, 2, 0)  # (component, row, mode) to (row, mode, component)
    stiffening = body.Kg_A.transpose(by_row) if np.any(body.Kg_A) else None
    return {
        "mdCM": Taylor(M0=body.s0[:, None], M1=body.S[:, :, None]),
        "J": _inertia(body, dialect),
        "Ct": Taylor(M0=body.S.T, M1=stiffening),
        "Cr": Taylor(M0=moment(body.H).T, M1=moment(field).transpose(by_row)),
        "Me": Taylor(M0=np.eye(body.n), symmetric=True),
        "Gr": Taylor(M0=_columns(2 * inertia(body.H).transpose(0, 2, 1), dialect.gr_by_axis)),
        "Ge": Taylor(M0=_columns(2 * moment(body.P).transpose(by_row), dialect.ge_by_axis)),
        "Oe": Taylor(M0=centrifugal(body.H).T, M1=centrifugal(field).transpose(by_row)),
        "ksigma": Taylor(M0=np.zeros((body.n, 1))),
        "Ke": Taylor(M0=np.diag(body.K), symmetric=True),
        "De": Taylor(M0=body.damping_matrix, symmetric=True),
    }


def node_terms(node: Node) -> dict[str, Taylor]:
    """Return the matrices of a node; a force f does the work ``(phi - Kg_F q) f`` on the modes."""
    return {
        "origin": Taylor(M0=node.position[:, None], M1=node.phi[:, :, None]),
        "phi": Taylor(M0=node.phi, M1=-node.Kg_F.swapaxes(1, 2) if np.any(node.Kg_F) else None),
        "psi": Taylor(M0=node.psi, M1=-node.Kg_T.swapaxes(1, 2) if np.any(node.Kg_T) else None),
        "AP": Taylor(M0=np.eye(3), M1=skew(node.psi.T).transpose(1, 0, 2)),
    }


def _inertia(body: FlexibleBody, dialect: Dialect) -> Taylor:
    J0 = inertia(body.E0)
    J1 = inertia(body.H + body.H.swapaxes(0, 1))
    if dialect.inertia_matrix:
        return Taylor(M0=J0, M1=J1.transpose(0, 2, 1), symmetric=True)
    rows = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
    return Taylor(M0=J0[rows][:, None], M1=J1[rows][:, :, None])


def _columns(blocks: np.ndarray, by_axis: bool) -> np.ndarray:
    """Arrange (row, mode, axis) in columns."""
    return (blocks.swapaxes(1, 2) if by_axis else blocks).reshape(len(blocks), -1)


def _lines(body: FlexibleBody, nodes: list[Node], dialect: Dialect) -> Iterator[str]:
    names = ", ".join(f"{number} {node.name}" for number, node in enumerate(nodes, start=1))
    comment = " ".join(f"{body.name} by modalprep, SI units; nodes {names}".split())[:COMMENT_LENGTH]
    yield dialect.header.format(nodes=len(nodes), modes=body.n, comment=comment)
    yield " part"
    yield _entry(6, "new modal", f" {' '.join(body.name.split())}" if dialect.named else "")
    yield from _modes(body, dialect)
    yield f"{'':11}frame"
    for number, node in enumerate(nodes, start=1):
        yield _entry(16, "new node", f"{number:9d}")
        yield _entry(21, "rframe", " body ref")
        for name, term in node_terms(node).items():
            yield from _block(21, name, term, body.n, dialect)
        yield f"{'':16}end node"
    yield f"{'':11}end frame"
    for name, term in body_terms(body, dialect).items():
        yield from _block(11, name, term, body.n, dialect)
    yield f"{'':6}end modal"
    yield " end part"


def _modes(body: FlexibleBody, dialect: Dialect) -> Iterator[str]:
    yield f"{'':11}refmod"
    yield _entry(16, "mass", dialect.number(body.m))
    yield _entry(16, "nelastq", f"{body.n:5d}")
    for mode, frequency in enumerate(body.frequency, start=1):
        yield _entry(16, f"ielastq ({mode:4d})", f" Eigen Mode {mode:4d} : {frequency:12.3f} Hz")
    yield f"{'':11}end refmod"


def _block(indent: int, name: str, term: Taylor, n: int, dialect: Dialect) -> Iterator[str]:
    yield f"{'':{indent}}{name}"
    rows, columns = term.M0.shape
    keys = {"order": int(term.M1 is not None), "nrow": rows, "ncol": columns, "nq": n, "nqn": 0}
    for key, value in (keys | {"structure": term.structure}).items():
        yield _entry(26, key, f"{value:5d}")
    yield from _entries("m0", term.M0, dialect)
    if term.M1 is not None:
        yield from _entries("m1", term.M1.swapaxes(1, 2) if dialect.mode_last else term.M1, dialect)
    yield f"{'':{indent}}end {name}"


def _entries(name: str, values: np.ndarray, dialect: Dialect) -> Iterator[str]:
    for place in np.argwhere(values):
        key = ",".join(f"{index + 1:2d}" for index in place)
        yield _entry(26, f"{name}({key})", dialect.number(float(values[tuple(place)])))


def _entry(indent: int, key: str, value: str) -> str:
    return f"{'':{indent}}{key}".ljust(VALUE_COLUMN) + f"={value}"
