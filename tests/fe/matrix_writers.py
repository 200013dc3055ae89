"""Matrix files as other programs write them, by the field descriptions of their manuals; independent of the readers."""

import io
import itertools
import pickle
import struct
import zipfile

import numpy as np
import scipy.io
import scipy.sparse as sp


def market(path, A):
    """MatrixMarket, symmetric."""
    scipy.io.mmwrite(path, sp.coo_matrix(A), symmetry="symmetric", precision=16)


def output4(path, matrices):
    """Text, ten digits, five to a line, columns from the first to the last entry."""
    out = []
    for name, A in matrices.items():
        A = A.toarray()
        n = len(A)
        out.append(f"{n:8d}{n:8d}{6:8d}{2:8d}{name:8s}1P,5E16.9")
        for j in range(n):
            rows = np.flatnonzero(A[:, j])
            if len(rows):
                values = A[rows[0] : rows[-1] + 1, j]
                out.append(f"{j + 1:8d}{rows[0] + 1:8d}{len(values):8d}")
                out += ["".join(f"{v:16.9E}" for v in values[k : k + 5]) for k in range(0, len(values), 5)]
        out += [f"{n + 1:8d}{1:8d}{1:8d}", f"{np.sqrt(2):16.9E}"]
    path.write_text("\n".join(out) + "\n")


def dmig(path, matrices, labels, points=None):
    """Large field, lower triangle; optionally with GRID cards before."""
    places = zip(labels, points, strict=True) if points is not None else ()
    out = [f"GRID,{g},,{x:.12f},{y:.12f},{z:.12f}" for g, (x, y, z) in places]
    for name, A in matrices.items():
        A, width = A.toarray(), len(A.toarray()) // len(labels)
        at = [(g, c + 1) for g in labels for c in range(width)]
        out.append(f"{'DMIG':8s}{name:8s}{0:8d}{6:8d}{2:8d}{0:8d}")
        for j, (g, c) in enumerate(at):
            rows = j + np.flatnonzero(A[j:, j])
            if len(rows):
                out.append(f"{'DMIG*':8s}{name:16s}{g:16d}{c:16d}")
                value = (f"{A[i, j]:16.9E}".replace("E", "D") for i in rows)
                out += [f"{'*':8s}{at[i][0]:16d}{at[i][1]:16d}{v}" for i, v in zip(rows, value, strict=True)]
    path.write_text("\n".join(out) + "\n")


def substructure(path, K, M, labels):
    """Abaqus *USER ELEMENT with packed lower triangles, four values to a line."""
    width = K.shape[0] // len(labels)
    out = [
        "**",
        "** GENERATION OF SUBSTRUCTURE Z1",
        f"*USER ELEMENT, NODES={len(labels):7d}, LINEAR",
        "** ELEMENT NODES",
    ]
    out += ["** " + ", ".join(f"{g:6d}" for g in labels[k : k + 10]) for k in range(0, len(labels), 10)]
    out.append(" " + ", ".join(str(c + 1) for c in range(width)))
    for kind, A in (("STIFFNESS", K.toarray()), ("MASS", M.toarray())):
        out.append(f"*MATRIX,TYPE={kind}")
        for i in range(len(A)):
            row = [f"{v:.16e}" for v in A[i, : i + 1]]
            out += [", ".join(row[k : k + 4]) for k in range(0, len(row), 4)]
    path.write_text("\n".join(out) + "\n")


def matrix_input(path, A, labels):
    """Abaqus ``*MATRIX OUTPUT, FORMAT=MATRIX INPUT``: one triangle, labels and dofs."""
    width, A = A.shape[0] // len(labels), sp.tril(A).tocoo()
    at = [(g, c + 1) for g in labels for c in range(width)]
    lines = [
        f"{at[i][0]},{at[i][1]}, {at[j][0]},{at[j][1]}, {v:.16e}"
        for i, j, v in zip(A.row, A.col, A.data, strict=True)
    ]  # fmt: skip
    path.write_text("\n".join(lines) + "\n")


def coordinates(path, A):
    """``row column value``, one triangle, as CalculiX writes .sti and .mas."""
    A = sp.triu(A).tocoo()
    path.write_text("".join(f"{i + 1} {j + 1} {v:.16e}\n" for i, j, v in zip(A.row, A.col, A.data, strict=True)))


def fem_archive(path, K, M, points, elements, sets):
    """The keys of an Exudyn FEM file, version 4, by numpy alone."""
    np.savez(
        path,
        type="FEMinterface",
        fileVersion=4,
        nodes=np.array({"Position": points}, dtype=object),
        elements=np.array([elements], dtype=object),
        massMatrix=np.array(sp.csr_matrix(M), dtype=object),
        stiffnessMatrix=np.array(sp.csr_matrix(K), dtype=object),
        nodeSets=np.array([{"Name": k, "NodeNumbers": v, "NodeWeights": v} for k, v in sets.items()], dtype=object),
    )


class Thief:
    """A pickle of this runs a command when it is read."""

    def __init__(self, command: str) -> None:
        self.command = command

    def __reduce__(self):
        import os

        return os.system, (self.command,)


def malicious_archive(path, source, member, payload):
    """A copy of the archive `source` in which one member is a pickle of `payload`."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name) if name != f"{member}.npy" else _object_array(payload))


def _object_array(payload) -> bytes:
    out = io.BytesIO()
    np.lib.format.write_array_header_1_0(out, {"descr": "|O", "fortran_order": False, "shape": ()})
    pickle.dump(payload, out)
    return out.getvalue()


def full(path, K, M, labels, held=(), order="<", **header):
    """Binary records of a .full file: standard header, header, components, nodes, both halves, DOFs of the nodes.

    The layout is that of the include file fdfull.inc in Ansys' Programmer's Reference; `held` are equations.
    """
    K, M = sp.triu(K).tocsr(), sp.triu(M).tocsr()
    n, width = K.shape[0], K.shape[0] // len(labels)
    state = np.zeros(n, dtype=int)
    state[list(held)] = -1

    def record(values, flags=1 << 31):
        data = np.asarray(values, dtype=f"{order}{'i4' if flags else 'f8'}").tobytes()
        return struct.pack(f"{order}iI", len(data) // 4, flags) + data + struct.pack(f"{order}i", len(data) // 4)

    def half(A):
        rows = [(A.indices[a:b] + 1, A.data[a:b]) for a, b in itertools.pairwise(A.indptr)]
        return b"".join(record(columns) + record(values, 0) for columns, values in rows)

    data = [
        record(range(1, width + 1)),
        record(labels),
        half(K),
        half(M),
        record([width] * len(labels)) + record(state),
    ]
    at = np.cumsum([206] + [len(block) // 4 for block in data])  # behind two headers of a hundred words
    words = {1: -4, 2: n, 4: 2, 7: len(labels), 8: width, 19: at[2], 27: at[3], 36: at[4]}
    words |= {int(k[1:]): v for k, v in header.items()}
    path.write_bytes(b"".join([record([4] * 100), record([words.get(k, 0) for k in range(1, 101)]), *data]))
