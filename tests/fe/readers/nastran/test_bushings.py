"""CBUSH: mass of its property, and an elastic centre off the line of its grids, against a spring at that place."""

import numpy as np
import pytest

import modalprep as mp

BARS = "GRID,1\nGRID,2,,1.\nGRID,3,,1.,.1\nGRID,4,,2.,.1\nCBAR,1,5,1,2,0.,1.,0.\nCBAR,2,5,3,4,0.,1.,0.\n"
BARS += "PBAR,5,7,.01,3.-6,2.-6,4.-6\nMAT1,7,2.+11,,.3,8000.\n"
BUSH = "PBUSH,8,K,3.+5,4.+5,5.+5,600.,700.,800."


def model(tmp_path, text):
    (tmp_path / "deck.bdf").write_text(text)
    return mp.assemble(mp.read_mesh(tmp_path / "deck.bdf"), {}, {"root": mp.Interface(node=1, kind="node")})


def test_mass(tmp_path):
    """Half of M at each end; of a grounded bushing all."""
    bare = model(tmp_path, f"{BARS}CBUSH,9,8,2,3,,,,0\n{BUSH}").rigid
    heavy = model(tmp_path, f"{BARS}CBUSH,9,8,2,3,,,,0\n{BUSH}\n,,M,6.").rigid
    assert heavy.m - bare.m == pytest.approx(6)
    np.testing.assert_allclose(heavy.s0 - bare.s0, [6, 0.3, 0], atol=1e-9)


@pytest.mark.parametrize("system", ["0", "4"])
def test_elastic_centre_by_coordinates(tmp_path, system):
    """The same as two grids at that place on rigid elements."""
    place = {"0": "1.3,.4,.2", "4": ".3,.4,.2"}[system]
    cord = "CORD2R,4,,1.,0.,0.,1.,0.,1.\n,2.,0.,0.\n"
    own = model(
        tmp_path, f"{BARS}{cord}CBUSH,9,8,2,3,,,,0,,{system},{place}\n{BUSH}".replace(",,,,0,,", ",,,,0,+\n+,,")
    )
    arms = "GRID,5,,1.3,.4,.2\nGRID,6,,1.3,.4,.2\nRBE2,20,2,123456,5\nRBE2,21,3,123456,6\n"
    ours = model(tmp_path, f"{BARS}{arms}CBUSH,9,8,5,6,,,,0\n{BUSH}")
    K = [(m.C.T @ m.K @ m.C).toarray()[:24, :24] for m in (own, ours)]
    np.testing.assert_allclose(K[0], K[1], atol=1e-9 * np.abs(K[1]).max())


def test_structural_damping_is_said_to_be_left_out(tmp_path):
    bare, damped = (model(tmp_path, f"{BARS}CBUSH,9,8,2,3,,,,0\n{BUSH}{more}") for more in ("", "\n,,GE,.06"))
    assert abs(bare.K - damped.K).max() == 0
    assert damped.damping is None
    assert any("PBUSH: its GE row is left out; a body is damped by one ratio" in note for note in damped.notes)
