"""Two bodies compared as physical systems."""

import json

import numpy as np
import pytest

from modalprep.body.difference import compare_bodies
from modalprep.body.recovery import Recovery
from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.formats.modalfile import write_body


def differences(a, b):
    return {check.name: check.value for check in compare_bodies(a, b)}


def rotated(body, pair, rng):
    """The same body with the modes of a repeated root turned into each other, and others flipped."""
    Q = np.diag(rng.choice([-1.0, 1.0], body.n))
    c, s = np.cos(angle := rng.uniform(0, 2 * np.pi)), np.sin(angle)
    Q[np.ix_(pair, pair)] = [[c, -s], [s, c]]
    turned = {name: getattr(body, name) @ Q for name in ("S", "H", "phi", "psi", "shape")}
    turned |= {name: Q.T @ getattr(body, name) @ Q for name in ("P", "Kg_A", "Kg_W", "Kg_F", "Kg_T")}
    return body.with_(**turned)


@pytest.fixture(scope="module")
def beam():
    return uniform_beam(modes=6)


def test_basis_does_not_count(beam):
    """Modes of a repeated root are no one's: rotations and signs leave round-off of 1e-9 at most."""
    twice = {name: np.r_[getattr(beam, name)[[0, 0]], getattr(beam, name)[2:]] for name in ("K", "D", "frequency")}
    beam = beam.with_(**twice)
    other = rotated(beam, [0, 1], np.random.default_rng(1))
    assert not np.allclose(other.phi, beam.phi)
    assert max(differences(beam, other).values()) < 1e-9


@pytest.mark.parametrize(
    ("field", "name", "share"),
    [
        ("m", "mass", 1.0),
        ("s0", "first moment", 0.5),  # of a beam, over mass times length
        ("E0", "inertia", 1.0),
        ("D", "damping", 1.0),
        ("S", "inertia coupling", 0.0),
        ("P", "mass integrals", 1.0),
        ("Kg_W", "geometric stiffness of accelerations", 0.0),
        ("Kg_F", "geometric stiffness of interface loads", 0.0),
        ("K", "flexibility", 1.0),
    ],
)
def test_a_change_shows_where_it_is(beam, field, name, share):
    """A property larger by 1e-3 differs by that share of 1e-3 (0: only by some), to first order."""
    beam = beam.with_(D=np.ones(beam.n))
    found = differences(beam, beam.with_(**{field: 1.001 * getattr(beam, field)}))
    assert found[name] > 1e-5
    if share:
        assert found[name] == pytest.approx(share * 1e-3, rel=3e-3)
    others = {other for other, value in found.items() if value > 1e-9} - {name}
    assert not others or field == "K"


def recovered(beam, seed=0, **changes):
    """The beam with random recovery matrices by mode acceleration."""
    random = np.random.default_rng(seed)
    arrays = {"q": random.standard_normal((2, 3, beam.n)), "qdd": random.standard_normal((2, 3, beam.n))}
    arrays["loads"] = random.standard_normal((2, 3, 24))
    names = {"kind": "force", "places": ("a", "b"), "components": ("x", "y", "z"), "units": ("N",) * 3}
    return beam.with_(recovery={"strut": Recovery(**names | arrays | changes)})


def test_recovery_matrices_are_compared(beam):
    """In whatever basis: their static response, and their part of the modal accelerations."""
    beam = recovered(beam)
    Q = np.array([1.0, -1, 1, -1, -1, 1])
    turned = beam.with_(**{name: getattr(beam, name) * Q for name in ("S", "H", "phi", "psi", "shape")})
    same = turned.with_(recovery={"strut": beam.recovery["strut"].in_basis(np.diag(Q))})
    assert differences(beam, same)["recovery"] < 1e-9
    block = beam.recovery["strut"]
    assert "recovery" not in differences(beam, turned.with_(recovery={}))
    for name in ("q", "qdd", "loads"):
        other = beam.with_(recovery={"strut": block.with_(**{name: 1.001 * getattr(block, name)})})
        assert 1e-7 < differences(beam, other)["recovery"] < 2e-3
    both = beam.with_(recovery={"strut": block.with_(q=1.001 * block.q, loads=1.001 * block.loads)})
    assert differences(beam, both)["recovery"] == pytest.approx(1e-3, rel=3e-3)  # over the larger one
    assert differences(beam, recovered(beam, places=("a", "c")))["recovery"] == np.inf


def test_fewer_modes(beam):
    fewer = uniform_beam(modes=4)
    found = differences(beam, fewer)
    assert found["frequencies"] == np.inf
    assert found["mass"] < 1e-12
    assert found["space of mode shapes"] < 1e-9  # the smaller space lies in the larger


def test_other_interfaces(beam):
    found = differences(beam, beam.with_(interface_name=("root", "end")))
    assert found["interfaces"] == np.inf
    assert "flexibility" not in found


def test_command(beam, tmp_path, capsys):
    """The same body in other coordinates is the same; a heavier one is not, and the row says by how much."""
    flipped = beam.with_(**{name: -getattr(beam, name) for name in ("S", "H", "phi", "psi", "shape")})
    files = [
        write_body(body, tmp_path / f"{k}.h5") for k, body in enumerate((beam, flipped, beam.with_(m=1.5 * beam.m)))
    ]
    assert main(["diff", str(files[0]), str(files[1])]) == 0
    capsys.readouterr()
    assert main(["diff", str(files[0]), str(files[2]), "--json"]) == 1
    found = {row["name"]: row for row in json.loads(capsys.readouterr().out)["checks"]}
    assert found["mass"]["value"] == pytest.approx(1 / 3)
    assert found["frequencies"]["passed"]
