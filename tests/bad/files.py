"""Bad mesh, matrix and modal files: what is done to a good one, and the words that the message must have."""

import io
import json
import lzma
import pickle
import zipfile
import zlib
from functools import partial
from unittest import mock

import h5py
import meshio
import numpy as np
from bad.good import CORNERS, HINGE, TET, write_lines, write_tets

BEAM_SECTION = 'type = "beam"\nmaterial = "alloy"\nA = 4e-4\nIy = 8e-7\nIz = 2e-7\nJ = 5e-7\n'


def changed(file, old, new):
    """Replace text in a file of the folder."""

    def change(folder):
        text = (folder / file).read_text()
        assert old in text
        (folder / file).write_text(text.replace(old, new, 1))

    return change


def content(file, data):
    """Replace all of a file."""

    def change(folder):
        (folder / file).write_bytes(data if isinstance(data, bytes) else data.encode())

    return change


def cut(file, share):
    """Keep the first part of a file."""

    def change(folder):
        data = (folder / file).read_bytes()
        (folder / file).write_bytes(data[: int(share * len(data))])

    return change


JUNK = np.random.default_rng(0).bytes(5000)
CUT = (0.0, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.999)
NOT_WHOLE = "damaged or cut short", "export it again"


def lines(points, connected):
    return lambda folder: write_lines(folder, points, connected)


def tets(*given, toml=TET, **more):
    def change(folder):
        write_tets(folder, *given, **more)
        (folder / "tet.toml").write_text(toml)

    return change


def rows_without_property(folder):
    write_lines(folder, [[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1], [1, 2]])
    text = (folder / "beam.msh").read_text().splitlines()
    names, last = text.index("$PhysicalNames"), text.index("$EndElements") - 1
    number, kind, tags, _, *rest = text[last].split()
    text[last] = " ".join([number, kind, tags, "3", *rest])
    text[names + 1 : names + 2] = ["3", '1 3 "strut"']
    (folder / "beam.msh").write_text("\n".join(text) + "\n")


def two_properties(folder):
    cells = [("vertex", np.array([[0]])), ("line", np.array([[0, 1], [1, 2]])), ("line", np.array([[0, 1]]))]
    numbers = [np.array([1]), np.array([2, 2]), np.array([3])]
    names = {"root": np.array([1, 0]), "beam": np.array([2, 1]), "strut": np.array([3, 1])}
    data = {"gmsh:physical": numbers, "gmsh:geometrical": numbers}
    mesh = meshio.Mesh(np.eye(3) * [1.0, 2.0, 3.0], cells, cell_data=data, field_data=names)
    meshio.gmsh.write(folder / "beam.msh", mesh, fmt_version="2.2", binary=False)
    changed("job.toml", "[properties.beam]", f"[properties.strut]\n{BEAM_SECTION}[properties.beam]")(folder)


def hinged_solids(shared):
    """Two tetrahedra that share an edge are hinged on it; on one corner, a ball joint."""
    far = {"edge": [(1, 0, 0), (2, 0, 1)], "corner": [(1, 0, 0), (2, 0, 0), (1, 0, -1)]}[shared]
    second = {"edge": (0, 1, 5, 4), "corner": (0, 4, 5, 6)}[shared]
    corners = [*CORNERS, *far]
    if np.linalg.det(np.subtract([corners[k] for k in second[1:]], corners[second[0]])) < 0:
        second = (*second[:2], second[3], second[2])
    return tets(corners, [(0, 1, 2, 3), second], held=(1, 2, 3))


def flat(top):
    at = ", ".join(f"{x:.4g}" for x in np.mean([*CORNERS[:3], top], axis=0))
    return ("run tet.toml", tets([*CORNERS[:3], top], [(0, 1, 2, 3)]), "flat", f"near ({at}) m", "repair the mesh")


def packed_points(compression):
    """Gigabytes of zeros are megabytes; here 72 megabytes, above what any file may have, in some hundred kilobytes."""

    def change(folder):
        points = np.zeros((3_000_000, 3))
        points[:4] = CORNERS
        mesh = meshio.Mesh(points, [("tetra", [[0, 1, 2, 3]])])
        with mock.patch.object(lzma, "compress", partial(lzma.compress, preset=0)):  # a tenth of the time
            meshio.write(folder / "zeros.vtu", mesh, compression=compression)

    return change


def packed_datasets(suffix):
    """The same in HDF5, by itself or beside an .xdmf file."""

    def change(folder):
        points = np.zeros((3_000_000, 3))
        points[:4] = CORNERS
        meshio.write(folder / f"zeros.{suffix}", meshio.Mesh(points, [("tetra", np.array([[0, 1, 2, 3]]))]))

    return change


ROD = TET + f"[properties.rod]\n{BEAM_SECTION}"
ONE = [(0, 1, 2, 3)]
MESHES = [
    *(("run job.toml", cut("beam.msh", share), "beam.msh", *NOT_WHOLE) for share in CUT),
    *(("run solid.toml", cut("bracket.msh", share), "bracket.msh", *NOT_WHOLE) for share in CUT),
    ("run job.toml", content("beam.msh", JUNK), "beam.msh", *NOT_WHOLE),
    ("run job.toml", content("beam.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"), "export it again"),
    ("run job.toml", changed("beam.msh", "\n10 0 0\n", "\nnan 0 0\n"), "not numbers", "the first is node", "repair"),
    *(
        ("run job.toml", changed("beam.msh", "\n42 41 2 \n", f"\n42 41 {n} \n"), "beam.msh")
        for n in ("0", "-3", "99", "x")
    ),
    *(
        ("run job.toml", changed("beam.msh", line, "\n"), "beam.msh")  # what follows would belong to another node
        for line in ("\n0 1 0 1\n", "\n23\n", "\n10 0 0\n", "\n30 29 30 \n")
    ),
    ("run job.toml", changed("beam.msh", "\n3 41 1 41\n", "\n3 4100000000000 1 41\n"), "beam.msh", *NOT_WHOLE),
    (
        "run job.toml",
        lines([[0, 0, 0], [1, 0, 0], [5, 0, 0], [6, 0, 0]], [[0, 1], [2, 3]]),
        "2 disconnected parts",
        "around (",
        "merge coincident nodes",
    ),
    (
        "run job.toml",
        lines([[0, 0, 0], [1, 0, 0], [1, 0, 0]], [[0, 1], [1, 2]]),
        "between nodes 2 and 3 has no length",
    ),
    ("run job.toml", rows_without_property, "1 of 2 line cells have no property (group 'strut')", "[properties]"),
    ("run job.toml", two_properties, "1 line cells have two properties", "its own cells"),
    ("run tet.toml", tets(CORNERS, [(0, 2, 1, 3)]), "inverted", "near (1.25, 1.25, 1.25) m", "repair the mesh"),
    flat((2, 2, 1)),
    flat((1, 1, 1)),
    flat((1.5, 1, 1)),
    ("run tet.toml", tets(CORNERS, ONE, held=(0,)), "'bolt'", "group 'bolt_a'", "on one line", "add nodes"),
    ("run tet.toml", tets(CORNERS, ONE, held=(0, 1)), "'bolt'", "group 'bolt_a'", "on one line", "add nodes"),
    (
        "run tet.toml",
        tets(CORNERS, ONE, held=(0,), toml=TET.replace('"bolt_a"', '"bolt_a"\nkind = "node"')),
        "'bolt'",
        "no rotations",
        "rbe2",
    ),
    ("run tet.toml", hinged_solids("edge"), "mechanism", "near (", "without strain", "connect that part"),
    ("run tet.toml", hinged_solids("corner"), "mechanism", "near (", "without strain", "connect that part"),
    (
        "run tet.toml",  # its nodes have no rotations: the rod hangs on a ball joint
        tets(CORNERS, ONE, held=(0, 2, 3), rod=(1, (4, 1, 1)), toml=ROD),
        "mechanism",
        ", 1, 1) m",
        "without strain",
    ),
    ("run plate.toml", content("plate.inp", ""), "plate.inp", "export it again"),
    ("run plate.toml", content("plate.inp", JUNK), "plate.inp"),
    ("run plate.toml", cut("plate.inp", 0.4), "plate.inp"),
    ("run plate.toml", changed("plate.inp", "2, 2, 3, 6, 5", "2, 2, 3, 9, 5"), "line 12", "node 9", "not there"),
    ("run plate.toml", changed("plate.inp", "2, 2, 3, 6, 5", "2, 2, 3"), "line 12", "4 nodes"),
    ("run plate.toml", changed("plate.inp", "2, 2, 3, 6, 5", "²2, 2, 3, 6, 5"), "line 12", "begins with no number"),
    ("run plate.toml", changed("plate.inp", "6, 2, 1, 0", f"{'9' * 5000}, 2, 1, 0"), "line 9", "begins with no number"),
    ("run plate.toml", changed("plate.inp", "6, 2, 1, 0", "6, inf, 1, 0"), "is not finite", "node 6"),
    ("run plate.toml", changed("plate.inp", "S4R", "S9X"), "'S9X' has no counterpart"),
    ("run plate.toml", changed("plate.inp", "1, 2, 1\n", "1, 2, 00\n"), "GENERATE needs first, last and step"),
    ("run plate.toml", changed("plate.inp", "1, 4\n", "edge\n"), "set 'edge' contains itself"),
    (
        "run plate.toml",
        changed("plate.inp", "*HEADING", "*INCLUDE, INPUT=a.inp\n*HEADING"),
        "*INCLUDE",
        "which is not there",
    ),
    ("run plate.toml", changed("plate.inp", "2, 2, 3, 6, 5", "2, 2, 6, 3, 5"), "plate.toml", "crossed"),
    ("run plate.toml", changed("plate.inp", "5, 1, 1, 0", "5, 0, 1, 0"), "no area"),
    ("run deck.toml", content("deck.bdf", ""), "deck.bdf"),
    ("run deck.toml", content("deck.bdf", JUNK), "deck.bdf"),
    ("run deck.toml", changed("deck.bdf", "BEGIN BULK\n", ""), "CEND but no BEGIN BULK"),
    ("run deck.toml", changed("deck.bdf", "GRID,3,,2.,0.,0.", "GRID,3,,2.,0.,x"), "line 6", "GRID 3"),
    ("run deck.toml", changed("deck.bdf", "GRID,3,,2.,0.,0.", "GRID,3,,2.+999,0.,0."), "deck.bdf"),
    ("run deck.toml", changed("deck.bdf", "GRID,3,,2.,0.,0.\n", ""), "grid 3 is not in the deck"),
    ("run deck.toml", changed("deck.bdf", "GRID,3,,2.", "GRID,2,,2."), "GRID 2", "keep one of the two"),
    ("run deck.toml", changed("deck.bdf", "GRID,3,,2.", "GRID,3,,1."), "no length"),
    ("run deck.toml", changed("deck.bdf", "MAT1,7", "MAT1,8"), "material 7 is not in the deck"),
    ("run deck.toml", changed("deck.bdf", "3000.", "-3000."), "positive"),
    ("run deck.toml", changed("deck.bdf", "PBAR,5", "PBAR,6"), "property 5 is not in the deck"),
    ("run deck.toml", changed("deck.bdf", "ENDDATA", "INCLUDE 'deck.bdf'"), "INCLUDE goes round in circles"),
    ("run deck.toml", changed("deck.bdf", "ENDDATA", "INCLUDE '/etc'"), "does not exist beside the deck"),
    ("run deck.toml", changed("deck.toml", '"deck.bdf"', '"deck.bdf"\nlength_unit = "mm"'), "mass_unit", "'t' with mm"),
    ("quality plate.vtu", content("plate.vtu", ""), "plate.vtu", "export it again"),
    ("quality plate.vtu", cut("plate.vtu", 0.5), "plate.vtu", "export it again"),
    ("quality plate.vtu", changed("plate.vtu", 'NumberOfPoints="6"', 'NumberOfPoints="600000000000"'), "plate.vtu"),
    ("quality plate.vtu", changed("plate.vtu", "<?xml", '<!DOCTYPE a [<!ENTITY b "c">]><?xml'), "plate.vtu"),
    ("quality plate.xyz", lambda folder: (folder / "plate.vtu").rename(folder / "plate.xyz"), "plate.xyz"),
    *(
        ("quality zeros.vtu", packed_points(compression), "zeros.vtu", "unpacks to far more than its size")
        for compression in ("zlib", "lzma")
    ),
    *(
        (f"quality zeros.{suffix}", packed_datasets(suffix), f"zeros.{suffix}", "unpacks to far more than its size")
        for suffix in ("cgns", "xdmf")
    ),
    ("quality none.msh", lambda folder: None, "none.msh does not exist"),
]


def archive(**arrays):
    """Write model.npz of arrays or raw members, and a pipeline file for it."""

    def change(folder):
        text = (folder / "matrices.toml").read_text()
        new = text.replace('stiffness = "k.mtx"\nmass = "m.mtx"\nnodes = "nodes.csv"', 'file = "model.npz"')
        (folder / "archive.toml").write_text(new)
        old = dict(np.load(folder / "model.npz")) | arrays
        with zipfile.ZipFile(folder / "model.npz", "w", zipfile.ZIP_DEFLATED) as file:
            for name, value in old.items():
                file.writestr(f"{name}.npy", value if isinstance(value, bytes) else saved(value))

    return change


def saved(array):
    out = io.BytesIO()
    np.save(out, array)
    return out.getvalue()


def declared(shape):
    """The head of a .npy file and hardly anything behind it."""
    out = io.BytesIO()
    np.lib.format.write_array_header_1_0(out, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return out.getvalue() + bytes(80)


class Harm:
    def __reduce__(self):
        return (open, ("stolen", "w"))


def pickled(value):
    out = io.BytesIO()
    np.lib.format.write_array_header_1_0(out, {"descr": "|O", "fortran_order": False, "shape": ()})
    return out.getvalue() + pickle.dumps(value)


MARKET = "%%MatrixMarket matrix coordinate real symmetric\n"
MATRICES = [
    ("run matrices.toml", content("k.mtx", ""), "k.mtx"),
    ("run matrices.toml", content("k.mtx", JUNK), "k.mtx"),
    ("run matrices.toml", cut("k.mtx", 0.5), "k.mtx is damaged or cut short", "write it again"),
    ("run matrices.toml", content("k.mtx", f"{MARKET}900000000 900000000 1\n1 1 1.0\n"), "k.mtx", "1 entries"),
    (
        "run matrices.toml",
        content("k.mtx", f"{MARKET}1e300 1e300 1\n1 1 1.0\n"),
        "k.mtx",
        "not a positive whole number",
    ),
    ("run matrices.toml", content("k.mtx", f"{MARKET}nan 2 1\n1 1 1.0\n"), "k.mtx", "not a positive whole number"),
    ("run matrices.toml", content("k.mtx", f"{MARKET}-2 -2 1\n1 1 1.0\n"), "k.mtx", "not a positive whole number"),
    ("run matrices.toml", content("k.mtx", "900000000 900000000 1.0\n"), "k.mtx", "1 entries"),
    ("run matrices.toml", content("k.mtx", f"{MARKET}2 2 1\n1 1 nan\n"), "not numbers"),
    ("run matrices.toml", content("nodes.csv", "0,0\n1,0\n"), "nodes.csv", "rows of 2 numbers"),
    ("run matrices.toml", content("nodes.csv", "0,0,0\n1,0,nan\n"), "coordinates that are not numbers"),
    ("run matrices.toml", content("nodes.csv", "0,0,0\n1,0,0\n"), "30 DOFs", "2 nodes"),
    ("run archive.toml", archive(K=JUNK), "model.npz is damaged"),
    ("run archive.toml", archive(K=declared((10**6, 10**6))), "K declares more than it holds", "write it again"),
    ("run archive.toml", archive(nodes=declared((10**12, 3))), "nodes declares more than it holds"),
    ("run archive.toml", archive(K=pickled(Harm())), "K is a pickle that is not read", "scipy.sparse.save_npz"),
    ("run archive.toml", archive(K=np.eye(30)), "archive.toml"),
    ("run archive.toml", archive(K=np.full((30, 30), np.nan)), "not numbers"),
    ("run archive.toml", archive(M=np.zeros((30, 30))), "mass"),
    ("run matrices.toml", changed("matrices.toml", '"nodes.csv"', '"nodes.npy"'), "nodes.npy does not exist"),
    (
        "run matrices.toml",
        lambda folder: (
            changed("matrices.toml", '"nodes.csv"', '"nodes.npy"')(folder),
            content("nodes.npy", declared((10**12, 3)))(folder),
        ),
        "nodes.npy is damaged",
    ),
]


def dataset(name, value, **options):
    """Replace a dataset of the modal file."""

    def change(folder):
        with h5py.File(folder / "body.h5", "a") as file:
            if name in file:
                del file[name]
            if value is None:
                return
            if isinstance(value, tuple):  # declared, never written
                file.create_dataset(name, shape=value, dtype="f4", **options)
            else:
                file[name] = value

    return change


def attribute(name, value, of="/"):
    """Replace an attribute."""

    def change(folder):
        with h5py.File(folder / "body.h5", "a") as file:
            file[of].attrs[name] = value

    return change


def zeros(n, chunk=None, **packing):
    """Megabytes of zeros in a file of kilobytes: every size is consistent."""

    def change(folder):
        with h5py.File(folder / "body.h5", "a") as file:
            del file["points"], file["shape"]
            for name, shape in {"points": (n, 3), "shape": (n, 3, 2)}.items():
                layout = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
                layout.set_chunk((min(n, chunk or n), *shape[1:]))
                layout.set_deflate(9)
                if packing.get("twice"):
                    layout.set_deflate(9)
                space = h5py.h5s.create_simple(shape)
                h5py.h5d.create(file.id, name.encode(), h5py.h5t.NATIVE_FLOAT, space, layout)
                for k in range(0, n, chunk or n):
                    file[name][k : k + (chunk or n)] = 0.0

    return change


def wide_chunk(folder):
    """Two numbers in a chunk of a hundred megabytes, which is unpacked to read them."""
    with h5py.File(folder / "body.h5", "a") as file:
        old = file["K"][()]
        del file["K"]
        chunked = {"maxshape": (None,), "chunks": (12_500_000,), "compression": "gzip"}
        file.create_dataset("K", shape=(2,), dtype=float, **chunked)[:] = old


def repeated_text(folder):
    """A thousand rows that refer to one text of a megabyte, in a file of a megabyte."""
    with h5py.File(folder / "body.h5", "a") as file:
        total, kind = file["modes"].attrs["total"], file["modes"].dtype
        row = np.empty(1, dtype=kind)
        row[:] = file["modes"][:1]
        row["reason"] = "x" * 10**6
        del file["modes"]
        rows = file.create_dataset("modes", shape=(1000,), dtype=kind, chunks=(1000,), compression="gzip")
        rows.attrs["total"] = total
        rows[:1] = row
        file.flush()
        packed = zlib.decompress(rows.id.read_direct_chunk((0,))[1])
        rows.id.write_direct_chunk((0,), zlib.compress(packed[: len(packed) // 1000] * 1000))


def elsewhere(name, link):
    def change(folder):
        with h5py.File(folder / "body.h5", "a") as file:
            del file[name]
            file[name] = link

    return change


def virtual(folder):
    with h5py.File(folder / "body.h5", "a") as file:
        layout = h5py.VirtualLayout(shape=(2,), dtype=float)
        layout[:] = h5py.VirtualSource("other.h5", "K", shape=(2,))
        del file["K"]
        file.create_virtual_dataset("K", layout)


def ring(folder):
    """A group that holds itself, twice: a walk that does not look where it has been never ends."""
    with h5py.File(folder / "body.h5", "a") as file:
        file["cells/a"] = file["cells/b"] = file["cells"]


def times(name, factor):
    """Scale a dataset of the modal file."""

    def change(folder):
        with h5py.File(folder / "body.h5", "a") as file:
            file[name][...] = factor * file[name][()]

    return change


def forged(change):
    """Take what vouches for the contents of a changed modal file away, as if an old version had written it."""

    def change_both(folder):
        change(folder)
        with h5py.File(folder / "body.h5", "a") as file:
            del file.attrs["checksum"]
            file.attrs["format_version"] = 1

    return change_both


def without_checksum(folder):
    with h5py.File(folder / "body.h5", "a") as file:
        del file.attrs["checksum"]


AGAIN = "body.h5", "write it again"
IMPOSSIBLE = {  # edits that were simulated without a word, and the identity that each violates
    "negative P": (times("P", -1.0), "modal mass"),
    "negative diagonal of P": (times("P", np.diag([-1.0, 1.0])), "modal mass"),
    "frequency without K": (times("frequency", 2.0), "modal stiffness"),
    "K without frequency": (times("K", 2.0), "modal stiffness"),
    "mass of a star": (times("m", 1e300), "mass and inertia"),
    "damping that drives": (dataset("D", np.array([-100.0, 0.0])), "modal damping"),
    "geometric stiffness": (times("Kg_W", 1e76), "sizes"),
    "geometric stiffness of a force": (times("Kg_F", 1e76), "sizes"),
    "heavy modes": (times("S", 1e3), "mass matrix"),
    "inertia": (dataset("E0", np.diag([400.0, -9.0, 0.0])), "mass and inertia"),
    "mode shapes": (times("shape", 1e20), "sizes"),
}
MODAL = [
    ("check none.h5", lambda folder: None, "modal file none.h5 does not exist"),
    ("check body.h5", content("body.h5", JUNK), "body.h5 is damaged or not a modal file"),
    *(
        (f"{command} body.h5", cut("body.h5", share), "body.h5 is damaged or not a modal file", "write it again")
        for command, share in [("check", s) for s in (0, 0.1, 0.5, 0.9, 0.99)] + [("modes", 0.99), ("render", 0.99)]
    ),
    ("simulate system.toml", cut("body.h5", 0.99), "body.h5 is damaged"),
    ("check run.h5", lambda folder: None, "run.h5", "no attribute format = 'modalprep'"),
    ("export body.h5 --to adams", lambda folder: None, "format 'adams' does not exist"),
    ("render body.h5 --mode 9", lambda folder: None, "no mode 9; its modes are 1 to 2"),
    ("check body.h5", attribute("format_version", 3), "body.h5", "version 3", "update modalprep"),
    ("check body.h5", attribute("format_version", "new"), *AGAIN),
    ("check body.h5", attribute("format_version", 0), "format version 0", "versions begin at 1", *AGAIN),
    ("check body.h5", attribute("units", "mm"), "units 'mm'", "the units are 'SI'", *AGAIN),
    ("check body.h5", without_checksum, "do not match its checksum", *AGAIN),
    ("check body.h5", attribute("checksum", "0" * 64), "do not match its checksum", *AGAIN),
    (
        "simulate system.toml",
        times("m", 1.0 + 1e-12),
        "do not match its checksum",
        "changed since it was written",
        *AGAIN,
    ),
    ("simulate system.toml", times("Kg_W", 1.01), "do not match its checksum", *AGAIN),
    ("simulate system.toml", attribute("name", "rod"), "do not match its checksum", *AGAIN),
    ("modes body.h5", attribute("program", "another"), "do not match its checksum", *AGAIN),
    ("export body.h5 --to sid", times("phi", 2.0), "do not match its checksum", *AGAIN),
    *(
        ("simulate system.toml", forged(change), f"check '{check}' failed", *AGAIN)
        for change, check in IMPOSSIBLE.values()
    ),
    ("check body.h5", attribute("inputs", "{"), *AGAIN),
    ("check body.h5", attribute("inputs", "[1]"), *AGAIN),
    ("check body.h5", attribute("inputs", "[" * 100_000), *AGAIN),
    ("check body.h5", attribute("total", np.zeros(2), "modes"), "total", *AGAIN),
    ("check body.h5", attribute("total", np.full(6, np.nan), "modes"), "total", *AGAIN),
    ("check body.h5", dataset("S", np.zeros((3, 5))), "S has shape (3, 5) instead of (3, 2)", *AGAIN),
    ("check body.h5", dataset("S", np.full((3, 2), np.nan)), "S holds values that are not numbers", *AGAIN),
    ("check body.h5", dataset("phi", None), "damaged or not a modal file", *AGAIN),
    ("check body.h5", dataset("K", np.array([b"a", b"b"])), *AGAIN),
    ("check body.h5", dataset("K", 3.0), *AGAIN),
    ("check body.h5", dataset("K", np.array([-1.0, 1.0])), "K", *AGAIN),
    ("check body.h5", dataset("m", 0.0), "m", *AGAIN),
    ("check body.h5", dataset("m", -1.0), "m", *AGAIN),
    ("simulate system.toml", dataset("m", -1.0), "m", *AGAIN),
    ("check body.h5", dataset("E0", 1j * np.ones((3, 3))), *AGAIN),
    ("check body.h5", dataset("modes", np.zeros(3)), *AGAIN),
    ("check body.h5", dataset("interface_name", np.array([1, 2])), *AGAIN),
    ("check body.h5", dataset("interface_name", np.array(["root", "root"], dtype=object)), "one name", *AGAIN),
    ("check body.h5", dataset("cells/line", np.array([[0, 999]])), "does not connect its points", *AGAIN),
    ("check body.h5", dataset("cells/line", np.zeros(3)), *AGAIN),
    ("check body.h5", dataset("cells/riddle", np.array([[0, 1]])), *AGAIN),
    ("check body.h5", dataset("points", np.zeros((0, 3))), "points is empty", *AGAIN),
    ("check body.h5", dataset("K", np.array(["a", "b"], dtype=object)), *AGAIN),
    (
        "check body.h5",
        dataset("P", (3, 3, 10**6, 10**6), chunks=(1, 1, 1000, 1000)),
        "P declares 3.6e+13 bytes",
        *AGAIN,
    ),
    ("check body.h5", dataset("extra", (10**12,), chunks=(1000,)), "extra declares", "file holds 0", *AGAIN),
    ("check body.h5", dataset("extra", (10**5,), external=[("/etc/passwd", 0, 400_000)]), "in other files", *AGAIN),
    ("check body.h5", zeros(20_000, twice=True), "declares", *AGAIN),
    ("check body.h5", zeros(2_000_000, chunk=500_000), "unpacks to 7.2e+07 bytes", "times its size", *AGAIN),
    ("check body.h5", wide_chunk, "unpacks to 1e+08 bytes", "times its size", *AGAIN),
    ("check body.h5", repeated_text, "the texts of modes are longer than the file", *AGAIN),
    (
        "check body.h5",
        attribute("inputs", np.array(["{}"] * 1000, dtype=object)),
        "inputs of / has more than 100 texts",
        *AGAIN,
    ),
    ("check body.h5", dataset("interface_name", np.array([["a"]], dtype=object)), "not a list of texts", *AGAIN),
    ("check body.h5", elsewhere("K", h5py.ExternalLink("run.h5", "time")), "K is an external link", *AGAIN),
    ("check body.h5", elsewhere("cells", h5py.ExternalLink("/dev/zero", "x")), "cells is an external link", *AGAIN),
    ("check body.h5", elsewhere("K", h5py.SoftLink("/D")), "K is an external link", *AGAIN),
    ("check body.h5", virtual, "K is stored in other files", *AGAIN),
    ("check body.h5", ring, *AGAIN),
]


def grid(**values):
    text = "\n".join(f'"{key.replace("__", ".")}" = {json.dumps(value)}' for key, value in values.items())
    return changed("job.toml", "[output]", f"[grid]\n{text}\n[output]")


OVERWRITES = "is read by this command, which would overwrite it; write to another file"


def linked(folder):
    """Another name of the modal file."""
    (folder / "again.sid_fem").symlink_to(folder / "body.h5")


def named(file, name):
    """The same file under another name."""
    return lambda folder: (folder / file).rename(folder / name)


def pushed_by_a_table(folder):
    """A force that follows the points of a file."""
    (folder / "push.csv").write_text("0, 0\n1, 2\n")
    changed("system.toml", '[0, "sin(t)", 0]', '[0, { file = "push.csv" }, 0]')(folder)


def welded(folder):
    """A synthesis that writes the bodies it reads: a second run would damp them once more."""
    (folder / "output" / "welds").mkdir(parents=True)
    (folder / "body.h5").rename(folder / "output" / "welds" / "welds-arm.h5")
    text = '[bodies.arm]\nfile = "output/welds/welds-arm.h5"\n[synthesis]\nmodes = 2\ndamping = 0.01\n'
    (folder / "welds.toml").write_text(text)


def drawn_over(folder):
    """A mesh where the run exports the modes."""
    (folder / "output" / "plate").mkdir(parents=True)
    (folder / "plate.vtu").rename(folder / "output" / "plate" / "plate.vtu")
    changed("plate.toml", "plate.inp", "output/plate/plate.vtu")(folder)
    changed("plate.toml", "[output]", '[output]\nexport = ["vtu"]')(folder)


A_FOLDER = "is a folder; name"
FOLDERS = [
    *((f"{command} .", lambda folder: None, A_FOLDER) for command in ("run", "simulate", "analyse", "batch")),
    *((f"{command} .", lambda folder: None, A_FOLDER) for command in ("modes", "check", "render", "quality")),
    ("diff body.h5 .", lambda folder: None, "modal file . is a folder; name a file in it"),
    ("run job.toml", changed("job.toml", '"beam.msh"', '"."'), "mesh file . is a folder; name a file in it"),
    ("simulate system.toml", changed("system.toml", '"body.h5"', '"."'), "modal file . is a folder"),
    *(
        ("run matrices.toml", changed("matrices.toml", file, "."), f"{what} . is a folder; name a file in it")
        for file, what in (("k.mtx", "matrix file"), ("nodes.csv", "file of nodes"))
    ),
]


def hinged(old, new):
    """A system whose body is built from its mesh, with something wrong that needs no body to be seen."""

    def change(folder):
        text = (folder / "job.toml").read_text() + HINGE.replace("t_end = 0.01", "t_end = 0.01\noutput = []")
        assert old in text
        (folder / "hinged.toml").write_text(text.replace(old, new).replace('"job.root"', '"hinged.root"'))

    return change


def built(old, new):
    """The system of `good.SYSTEM`, its arm built from a mesh, with something wrong that needs no body to be seen."""

    def change(folder):
        (folder / "arm.toml").write_text((folder / "job.toml").read_text() + "[interfaces.tip]\nnode = 2\n")
        text = (folder / "system.toml").read_text().replace('file = "body.h5"', 'pipeline = "arm.toml"')
        assert old in text
        (folder / "built.toml").write_text(text.replace(old, new))

    return change


def unread(text=""):
    """A mesh that cannot be read, which is not found out where the outputs cannot be written."""

    def change(folder):
        content("beam.msh", JUNK)(folder)
        content("taken", "")(folder)
        (folder / "job.toml").write_text((folder / "job.toml").read_text() + text)

    return change


def keeping(text):
    """A selection that cannot be read, which is found out before the mesh."""

    def change(folder):
        content("beam.msh", JUNK)(folder)
        job = folder / "job.toml"
        job.write_text(job.read_text().replace("modes = 3", f'modes = 3\nkeep = "{text}"'))

    return change


TAKEN = "cannot write", "taken", "choose another --output folder"
BEFORE_WORK = [
    *((f"{command} job.toml --output taken", unread(HINGE), *TAKEN) for command in ("run", "simulate", "modes")),
    *((f"{command} job.toml --output taken", unread("[analysis]\n"), *TAKEN) for command in ("run", "analyse")),
    ("simulate job.toml -o taken/run.h5", unread(HINGE), *TAKEN),
    (
        "run job.toml",
        keeping("effectivemass > 10%"),
        "keep: 'effectivemass > 10%' is not a comparison of",
        "did you mean 'effective_mass'?",
    ),
    ("simulate job.toml -o /proc/closed/run.h5", unread(HINGE), "cannot write /proc/closed/run.h5"),
    ("simulate job.toml --animate taken/run.gif", unread(HINGE), *TAKEN),
    ("quality beam.msh --picture taken/a.png", unread(), *TAKEN),
    *((f"export beam.msh --to sid -o {to}", unread(), "cannot write") for to in ("taken/a", "/dev/null")),
    ("render beam.msh -o taken/a.png", unread(), *TAKEN),
    ("mesh plate -o taken/a.msh", unread(), *TAKEN),
    (
        "simulate hinged.toml",
        hinged("output = []", 'output = ["arm.tip.position"]'),
        "no channel 'arm.tip.position'",
    ),
    ("run hinged.toml", hinged("output = []", "output_step = 1e-13"), "output times; lower t_end or raise output_step"),
    ("simulate hinged.toml", hinged('child = "job.root"', 'child = "arm.root"'), "child body 'arm' does not exist"),
    (
        "simulate hinged.toml",
        hinged('child = "job.root"', 'parent = "x.y"\nchild = "job.root"'),
        "its parent: body 'x' does not exist",
    ),
    (
        "simulate hinged.toml",
        hinged('child = "job.root"', 'child = "job.root"\naxis = [0, 0, 0]'),
        "joint 'hinge'",
        "axis",
    ),
    ("modes hinged.toml", hinged("interfaces.root", "interfaces.ground"), "has the name of the ground"),
    ("run hinged.toml", hinged("output = []", 'output = ["hinge.angel"]'), "no channel 'hinge.angel'", "hinge.angle"),
    ("run hinged.toml", hinged("output = []", 'output = ["job.root.place"]'), "no channel 'job.root.place'"),
    ("run hinged.toml", hinged("output = []", '[[plots]]\ny = "hinge.rat"'), "no channel 'hinge.rat'"),
    ("run hinged.toml", hinged("output = []", '[[plots]]\ny = "hinge.angle"\nrelative_to = "hub"'), "hub.origin"),
    (
        "run hinged.toml",
        hinged("output = []", '[events.stop]\nwhen = "hinge.angel - 1"'),
        "event 'stop'",
        "hinge.angel",
    ),
    (
        "run hinged.toml",
        hinged("output = []", '[events.stop]\nwhen = "hinge.angle"\nactivates = ["x"]'),
        "event 'stop': closure 'x'",
    ),
    (
        "run hinged.toml",
        hinged("output = []", '[controls.law]\nat = "hinge"\nvalues = ["-hinge.rates"]'),
        "control 'law'",
        "hinge.rates",
    ),
    ("run hinged.toml", hinged("output = []", '[analysis]\ninputs = ["hinge.force"]'), "input 'hinge.force'"),
    ("analyse hinged.toml", hinged("output = []", '[analysis]\noutputs = ["hinge.angel"]'), "output 'hinge.angel'"),
    (
        "run built.toml",
        built('parent = "arm.tip"', 'parent = "arm.bolt_z"'),
        "'arm.bolt_z' names no interface",
        "arm has",
    ),
    ("run built.toml", built('child = "arm.root"', 'child = "arm.tip"'), "is not the root interface of 'arm'"),
    ("simulate built.toml", built('"bob.root"]', '"arm.bolt_z"]'), "spring 'rope'", "'arm.bolt_z' names no interface"),
    ("simulate built.toml", built('at = "arm.tip"', 'at = "arm.end"'), "force 'push'", "'arm.end' names no interface"),
    (
        "run built.toml",
        built("[simulation]", '[closures.loop]\ntype = "spherical"\na = "arm.end"\n[simulation]'),
        "'arm.end'",
    ),
    (
        "run built.toml",
        built("[simulation]", "[couplers.gear]\nfactors = { hing = 1.0 }\n[simulation]"),
        "'gear'",
        "'hing'",
    ),
    ("run built.toml", built("[simulation]", '[immersed.a]\nbodies = "b*"\ndiameter = 1.0\n[simulation]'), "no water"),
]


def interface(name):
    return changed("job.toml", "[interfaces.root]", f"[interfaces.{name}]")


NAMES = [
    ("modes job.toml", interface('"a\\u0000b"'), "interface 'a\\x00b' has '\\x00' in its name; choose another"),
    ("modes job.toml", interface('"a/b"'), "interface 'a/b' has '/' in its name"),
    ("modes job.toml", interface("ground"), "interface 'ground' has the name of the ground"),
    ("modes job.toml", interface('""'), "interface '' has an empty name; give it one"),
    ("modes job.toml", changed("job.toml", "[mesh]", 'name = "a\\u0000b"\n[mesh]'), "character NUL"),
    ("simulate system.toml", changed("system.toml", "bodies.bob", 'bodies."b\\u001b[31m"'), "[bodies]", "in its name"),
    ("simulate system.toml", changed("system.toml", "bodies.bob", 'bodies."b.b"'), "body 'b.b' has '.' in its name"),
    ("simulate system.toml", changed("system.toml", "joints.wrist", 'joints."a/b"'), "joint 'a/b'"),
    ("modes job.toml", changed("job.toml", "E = 7e10", f"E = {'7' * 400}"), "a number of 400 digits is no quantity"),
    ("modes job.toml", changed("job.toml", "modes = 3", f"modes = {'7' * 400}"), "[reduction.modes]", "400 digits"),
    (
        "simulate system.toml",
        changed("system.toml", "[0, -9.81, 0]", '"9.81"'),
        "'9.81' is a text, but this key needs a list or table",
    ),
    *(
        (f"{command} .", lambda folder: None, "cannot write .: Is a directory; name a file in it")
        for command in (
            "export body.h5 --to sid -o",
            "render body.h5 -o",
            "quality beam.msh --picture",
            "simulate system.toml -o",
        )
    ),
    ("export . --to sid", lambda folder: None, "modal file . is a folder; name a file in it"),
]


WIDE = {f"materials__alloy__{name}": list(range(1, 101)) for name in ("E", "nu", "rho")}
COMMANDS = [
    ("run none.toml", lambda folder: None, "none.toml does not exist"),
    ("modes none.toml", lambda folder: None, "none.toml does not exist"),
    ("simulate none.toml", lambda folder: None, "none.toml does not exist"),
    ("simulate job.toml", lambda folder: None, "job.toml has no [simulation]", "t_end"),
    ("analyse system.toml", lambda folder: None, "system.toml has no [analysis]", "add one"),
    ("run empty.toml", content("empty.toml", ""), "empty.toml", "nothing to do", "needs [mesh]"),
    ("run job.toml", content("job.toml", b"name = '\xff'"), "job.toml is not valid TOML"),
    ("run job.toml", content("job.toml", JUNK), "job.toml is not valid TOML"),
    ("run job.toml", content("job.toml", "mesh = 3"), "job.toml", "[mesh]"),
    ("run job.toml", content("job.toml", "[[joints]]\nx = 1\n"), "job.toml", "[joints]"),
    ("run job.toml", content("job.toml", "[simulation]\nt_end = 1.0\n"), "job.toml", "no bodies"),
    ("run body.h5", lambda folder: None, "body.h5 is no pipeline file (TOML); modalprep explain"),
    ("run beam.msh", lambda folder: None, "beam.msh is no pipeline file (TOML); modalprep init beam.msh"),
    ("run job.toml --modes 30", lambda folder: None, "--modes", "--set reduction.modes=VALUE replaces the value"),
    ("run job.toml --t-end 30", lambda folder: None, "--t-end", "--set simulation.t_end=VALUE replaces the value"),
    *(
        (f"export body.h5 --to {to} -o {target}", lambda folder: None, "body.h5", OVERWRITES)
        for to, target in (("sid", "body.h5"), ("exudyn", "output/../body.h5"), ("vtu", "./body.h5"))
    ),
    ("export body.h5 --to sid -o again.sid_fem", linked, "again.sid_fem", OVERWRITES),
    ("export body.fem --to mbdyn", named("body.h5", "body.fem"), "body.fem", OVERWRITES),
    ("render body.png -o body.png", named("body.h5", "body.png"), "body.png", OVERWRITES),
    ("quality plate.png --picture plate.png", named("plate.vtu", "plate.png"), "plate.png", OVERWRITES),
    ("quality plate.toml --picture plate.inp", lambda folder: None, "plate.inp", OVERWRITES),
    *(
        (f"simulate system.toml -o {target}", lambda folder: None, target, OVERWRITES)
        for target in ("body.h5", "system.toml")
    ),
    ("simulate system.toml -o push.h5", pushed_by_a_table, "push.csv", OVERWRITES),
    ("simulate system.toml --animate run.gif -o run.gif", lambda folder: None, "run.gif", OVERWRITES),
    ("run welds.toml", welded, "welds-arm.h5", OVERWRITES),
    ("run plate.toml", drawn_over, "plate.vtu", OVERWRITES),
    ("run system.toml --output job.toml", lambda folder: None, "cannot write", "choose another --output"),
    ("run job.toml --outputs x", lambda folder: None, "--outputs", "see modalprep --help"),
    ("rum job.toml", lambda folder: None, "rum", "see modalprep --help"),
    ("batch none*.toml", lambda folder: None, "no pipeline file matches"),
    ("batch job.toml -j 0", lambda folder: None, "at least 1"),
    ("batch job.toml", grid(), "[grid] is empty"),
    ("batch job.toml", grid(reduction__modes=[]), "needs a list of values"),
    ("batch job.toml", grid(reduction__modes=[1, 1]), "lists a value twice"),
    ("batch job.toml", grid(reduction__mods=[1, 2]), "no combination", "unknown key 'mods'"),
    ("batch job.toml", grid(**WIDE), "1000000 combinations", "give fewer values"),
    ("mesh plate -p length=nan", lambda folder: None, "length = nan is not a finite number"),
    ("mesh plate -p length=1e9", lambda folder: None, "length", "give metres"),
    ("mesh plat", lambda folder: None, "unknown shape 'plat'", "did you mean 'plate'?"),
]
