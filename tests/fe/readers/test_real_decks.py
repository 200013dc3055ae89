"""Decks of real projects, with Nastran's own answers where they have them; its reduction is in reduction/.

The decks are those of a public repository, SteveDoyle2/pyNastran: models/iSat and models/sol_101_elements, with the
eigenvalues of MSC Nastran that stand beside the second.
"""

import numpy as np
import pytest
from shared_data import DATA

import modalprep as mp
from modalprep.linalg.modes import lowest_modes
from modalprep.reduction.clamped import clamp

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"the decks are not in {DATA} (set MODALPREP_DATA)")


@pytest.fixture(scope="module")
def isat():
    mesh = mp.read_mesh(DATA / "isat" / "ISat_Launch_Sm_4pt.dat", "in", "slinch")
    return mp.assemble(mesh, {}, {f"mount_{k}": mp.Interface(node=5629 + k, kind="node") for k in range(1, 5)})


def test_isat_floats_with_six_rigid_motions():
    """On its adapter: a single foot is a bipod on two bushings, which turns about their line without strain."""
    mesh = mp.read_mesh(DATA / "isat" / "ISat_Launch_Sm_4pt.dat", "in", "slinch")
    model = mp.assemble(mesh, {}, {"adapter": mp.Interface(group="spc_1_123")})
    K, M = ((model.C.T @ A @ model.C).tocsr() for A in (model.K, model.M))
    w2, _, _ = lowest_modes(K, M, 8, shift=-100.0)
    frequency = np.sqrt(np.abs(w2)) / (2 * np.pi)
    assert np.all(frequency[:6] < 1e-3)  # round-off: 1e-16 of stiffnesses of 4e10 N/m on 310 kg
    assert frequency[6] > 5.0
    assert all(check.passed for check in mp.body.check_model(model))


def test_isat_goes_the_whole_road(isat, tmp_path):
    reduction = mp.craig_bampton(isat, modes=2, truncation=())
    body = mp.flexible_body(isat, reduction, name="isat", second_order_mass=False)  # that of the satellite has it
    body = mp.read_body(mp.write_body(body, tmp_path / "isat.h5"))
    assert body.m == pytest.approx(310.780, rel=1e-5)  # test_nastran.py sums the cards
    assert [check.name for check in mp.check_body(body) if not check.passed] == []
    # each mount is a bipod on two bushings without rotational stiffness: it turns freely about their line
    assert np.count_nonzero(body.frequency == 0) == 4
    assert body.interface_name == ("mount_1", "mount_2", "mount_3", "mount_4")


def test_every_family_of_the_small_deck():
    mesh = mp.read_mesh(DATA / "nastran_modes" / "mode_solid_shell_bar.bdf", "m", "kg")
    model = mp.assemble(mesh, {}, {"base": mp.Interface(box=((-1, -1, -3.1), (2, 2, -2.9)))})
    assert set(model.cells) == {"hexahedron", "wedge", "tetra", "quad", "triangle", "line"}
    assert all(check.passed for check in mp.body.check_model(model))
    held = clamp(model)
    w2, _, _ = lowest_modes(held.K_ii, held.M_ii, 3, factor=held.factor)
    nastran = [71.26832, 75.95746, 125.7872]
    # a dozen elements: bending within 3 %; torsion of the shells, where formulations differ most, within 15 %
    np.testing.assert_allclose(np.sqrt(w2[:2]) / (2 * np.pi), nastran[:2], rtol=0.03)
    np.testing.assert_allclose(np.sqrt(w2[2]) / (2 * np.pi), nastran[2], rtol=0.15)
    assert any("hidden hinge" in note for note in model.notes)
