"""Shear centres of thin-walled sections: closed forms, and the resultant of shear flows as a second way."""

from itertools import pairwise

import numpy as np
import pytest

import modalprep as mp
from modalprep.fe.readers.nastran.shapes import SHAPES
from modalprep.fe.readers.nastran.shear_centres import WALLS, centroid_from_shear_centre

LOOPS = {  # of walls, with their direction in the loop
    "BOX1": [{0: 1, 1: 1, 2: 1, 3: 1}],
    "DBOX": [{0: 1, 6: 1, 4: 1, 5: 1}, {1: 1, 2: 1, 3: 1, 6: -1}],
    "HAT1": [{2: 1, 3: 1, 4: 1, 5: 1}],
    "GBOX": [{1: 1, 7: 1, 4: -1, 6: -1}],
}


def by_shear_flow(points, walls, loops):
    """Centroid from the shear centre: the resultants of the flows of unit forces, which twist no cell."""
    fine, parts = cut_small(np.array(points, dtype=float), walls)
    first, second, t = fine[parts[:, 0].astype(int)], fine[parts[:, 1].astype(int)], parts[:, 2]
    d, middle = second - first, (first + second) / 2
    length = np.linalg.norm(d, axis=1)
    area = t * length
    middle = middle - area @ middle / area.sum()
    moments = (middle * area[:, None]).T @ middle
    n = parts[:, :2].max().astype(int) + 1
    balance = np.zeros((n, len(parts)))
    for k, (a, b, _) in enumerate(parts):
        balance[int(a), k], balance[int(b), k] = -1.0, 1.0
    owner = np.repeat(np.arange(len(walls)), PIECES)
    twist = np.array([[loop.get(w, 0) for w in owner] for loop in loops]).reshape(len(loops), len(parts)) * length / t
    arm = middle[:, 0] * d[:, 1] - middle[:, 1] * d[:, 0]
    found = []
    for force in np.eye(2):
        stress = middle @ np.linalg.solve(moments, force) * area  # change of the axial forces, which the flows balance
        gain = np.zeros(n)
        np.add.at(gain, parts[:, 0].astype(int), stress / 2)
        np.add.at(gain, parts[:, 1].astype(int), stress / 2)
        q = np.linalg.lstsq(np.vstack([balance, twist]), np.concatenate([gain, np.zeros(len(loops))]), rcond=None)[0]
        flow = q @ d
        assert abs(flow @ force) == pytest.approx(1.0, rel=2e-3)
        found.append(q @ arm * np.sign(flow @ force))
    return np.array([-found[1], found[0]])  # moments of a force along y: -z, along z: y of the shear centre


PIECES = 30


def cut_small(points, walls):
    """Points and walls of `PIECES` a wall."""
    found, parts = list(points), []
    for a, b, t in walls:
        inner = [points[a] + (points[b] - points[a]) * k / PIECES for k in range(1, PIECES)]
        chain = [a, *range(len(found), len(found) + PIECES - 1), b]
        found += inner
        parts += [(i, j, t) for i, j in pairwise(chain)]
    return np.array(found), np.array(parts)


SIZES = {
    "L": (8.0, 10.0, 0.6, 0.4),
    "CHAN": (5.0, 10.0, 0.4, 0.6),
    "HAT": (6.0, 0.3, 8.0, 3.0),
    "HAT1": (14.0, 7.0, 8.0, 0.3, 0.5),
    "BOX1": (8.0, 12.0, 0.3, 0.6, 0.5, 0.2),
    "DBOX": (14.0, 9.0, 5.0, 0.3, 0.2, 0.6, 0.5, 0.4, 0.3, 0.7),
    "GBOX": (12.0, 9.0, 0.3, 0.6, 0.4, 6.0),
}


@pytest.mark.parametrize("kind", SIZES)
def test_the_resultant_of_shear_flows_passes_the_shear_centre(kind):
    points, walls = WALLS[kind](*SIZES[kind])
    found = centroid_from_shear_centre(points, walls)
    flows = by_shear_flow(points, walls, LOOPS.get(kind, []))
    np.testing.assert_allclose(found, flows, rtol=0, atol=3e-3 * SIZES[kind][0])  # 1 / PIECES^2
    assert np.abs(found).max() > 0.05


def test_closed_forms():
    """A channel (Roark, 7th edition, table 9.2), an angle whose walls meet there, equal boxes."""
    b, h, tw, tf = 5.0, 10.0, 0.4, 0.6
    c, d = b - tw / 2, h - tf
    web = 3 * c**2 * tf / (d * tw + 6 * c * tf)
    centroid = c**2 * tf / (2 * c * tf + d * tw)
    for kind, sizes, expected in (
        ("CHAN", (b, h, tw, tf), (0.0, web + centroid)),
        ("CHAN1", (b - tw, tw, h - 2 * tf, h), (0.0, web + centroid)),
        ("CHAN2", (tf, tw, b, h), (web + centroid, 0.0)),
        ("L", (5.0, 9.0, 0.4, 0.4), (8.8**2 / 2 / 13.6, 4.8**2 / 2 / 13.6)),
        ("BOX1", (8.0, 12.0, 0.5, 0.5, 0.3, 0.3), (0.0, 0.0)),
        ("DBOX", (14.0, 9.0, 7.0, *[0.5] * 7), (0.0, 0.0)),
        ("GBOX", (12.0, 9.0, 0.5, 0.5, 0.4, 6.0), (0.0, 0.0)),
    ):
        np.testing.assert_allclose(centroid_from_shear_centre(*WALLS[kind](*sizes)), expected, rtol=1e-12, atol=1e-12)


def beam(read, kind, sizes, length):
    """A cantilever along x with its y axis along y of the mesh."""
    fields = [*(f"{size:g}" for size in sizes), ""]
    rows = [",".join(fields[k : k + 8]) for k in range(0, len(fields), 8)]
    card = f"PBEAML,5,7,,{kind},,,,,+\n+," + "\n+,".join(rows) + "\n"
    element = f"GRID,1,,0.,0.,0.\nGRID,2,,{length},0.,0.\nCBEAM,9,5,1,2,0.,1.,0.\n"
    mesh = read(element + card + "MAT1,7,2.+11,,.3,7800.\n")
    return mesh, mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})


@pytest.mark.parametrize(("kind", "sizes"), [("DBOX", (14, 9, 5, 1, 2, 3, 0.5, 1.5, 1, 2)), ("L", (8, 10, 1, 1))])
def test_a_section_with_a_product_of_inertia_bends_sideways_to_its_side(read, kind, sizes):
    """Deflections of a slender cantilever: ``l^3 / 3 E`` times the inverse of the matrix of moments."""
    length = 5000.0
    model = beam(read, kind, sizes, length)[1]
    _, I1, I2, I12 = SHAPES[kind][1](*sizes)[:4]
    assert abs(I12) > 0.01 * I1
    tip = model.dof[1]
    K = model.K.toarray()[np.ix_(tip, tip)]
    found = np.linalg.solve(K, np.eye(6))[1:3, 1:3]
    exact = np.linalg.inv([[I1, I12], [I12, I2]]) * length**3 / 3 / 2e11
    np.testing.assert_allclose(found, exact, rtol=0, atol=2e-4 * np.abs(exact).max())  # shear: (h / l)^2


def test_a_force_beside_the_shear_centre_twists(read):
    """A channel: the force on the element's axis does not, one at the centroid does by its arm."""
    mesh, model = beam(read, "CHAN", SIZES["CHAN"], 100.0)
    own = mesh.properties["pbeaml_5"]
    arm = centroid_from_shear_centre(*WALLS["CHAN"](*SIZES["CHAN"]))
    np.testing.assert_allclose(own.offset, (-arm[1], arm[0]), rtol=1e-12, atol=1e-12)  # e2 goes against z
    tip = model.dof[1]
    answer = np.linalg.inv(model.K.toarray()[np.ix_(tip, tip)])
    assert abs(answer[3, 1]) < 1e-9 * abs(answer[1, 1] / 100.0)
    assert any("PBEAML CHAN: the shear centre" in note for note in mesh.notes)
