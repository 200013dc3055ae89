"""Decks of other programs: a script of Exudyn is run and moves as the system does; what it cannot carry is refused."""

import importlib.util

import numpy as np
import pytest
from compare import assert_close

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.formats.decks.exudyn import lost_in_exudyn_script, write_exudyn_script
from modalprep.formats.decks.mbdyn import lost_in_mbdyn_deck, write_mbdyn_deck
from modalprep.formats.decks.start import start_of
from modalprep.multibody import Closure, HingeElement

ENDS = {"root": [0, 0, 0], "end": [2.0, 0, 0]}
LINK = mp.rigid_body("link", mass=3.0, centre=[1.0, 0.1, 0.05], inertia=np.diag([0.2, 0.5, 0.6]), interfaces=ENDS)
QUARTER = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # about x


def two_links():
    """A rigid link on a skew hinge with spring, damper and drive; a damped modal beam across it, with a force."""
    beam = uniform_beam(modes=2, truncation=("interfaces",)).conventional()
    motor = HingeElement(stiffness=50.0, free_position=0.2, damping=3.0, drive="20*sin(3*t)")
    shoulder = {"axis": [0, 0.6, 0.8], "position": [0, 0, 1.0], "angle": 0.3, "rate": 0.5, "elements": motor}
    elbow = {"rotation": QUARTER, "rate": -0.3, "elements": HingeElement(damping=30.0)}
    return mp.System(
        bodies={"link": LINK, "arm": beam.with_(D=0.04 * np.sqrt(beam.K))},
        joints=(
            mp.Joint(name="shoulder", type="revolute", parent="ground", child="link", **shoulder),
            mp.Joint(name="elbow", type="revolute", parent="link.end", child="arm", **elbow),
        ),
        gravity=[0, -3.0, -1.0],
        loads=(mp.PointForce(name="p", at="arm.tip", force=("2*t", 0, 1.0)),),
    )


def slider():
    """A crank that turns at a rate that changes, a rod, and a slide with spring that closes the loop."""
    law = mp.multibody.TimeFunction([(0.5, "t^2"), (float("inf"), "t - 0.25")])
    joints = (
        mp.Joint(name="crank", type="revolute", parent="ground", child="crank", motion=law),
        mp.Joint(name="knee", type="revolute", parent="crank.end", child="rod", angle=0.0),
        mp.Joint(name="slide", type="prismatic", parent="ground", child="block", axis=[1.0, 0, 0], displacement=4.0,
                 elements=HingeElement(stiffness=20.0, free_position=3.0, damping=1.0, drive="5*t")),
    )  # fmt: skip
    block = mp.rigid_body("block", mass=1.0, centre=[0, 0, 0], inertia=np.eye(3), interfaces={"root": [0, 0, 0]})
    pin = Closure(name="pin", type="spherical", a="rod.end", b="block.root")
    return mp.System(
        bodies={"crank": LINK, "rod": LINK, "block": block}, joints=joints, closures=(pin,), gravity=[0, -9.81, 0]
    )


def loaded(script):
    spec = importlib.util.spec_from_file_location(script.stem, script)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("make", [two_links, slider])
def test_exudyn_moves_as_the_system(make, tmp_path):
    """Its method is of second order: at 1 ms the modes, of up to 80 rad/s, are off by 1e-4, places by 1e-6."""
    pytest.importorskip("exudyn")
    system = make()
    script = write_exudyn_script(system, tmp_path / f"{make.__name__}.py", t_end=1.0, step=1e-3, output_step=0.1)
    found = loaded(script).run()
    run = mp.simulate(system, 1.0, output_step=0.1, rtol=1e-9)
    assert_close(found.pop("time"), run.time, 1e-9)
    assert len(found) == 5
    for name, values in found.items():
        expected = run[name].reshape(len(run.time), -1)
        scale = np.abs(expected).max() or 1.0
        assert_close(values, expected, 1e-4 if name.endswith("modal") else 2e-6, scale=scale, name=name)


def test_what_a_script_cannot_carry_is_refused(tmp_path):
    system = two_links()
    hard = system.joints[0].with_(elements=HingeElement(friction=1.0))
    with pytest.raises(mp.InputError, match="cannot carry friction or limits of joints: shoulder; leave them out"):
        write_exudyn_script(system.with_(joints=(hard, system.joints[1])), tmp_path / "a.py")
    curve = mp.multibody.TimeFunction.table([0.0, 1.0, 2.0], [0.0, 1.0, 3.0])
    drive = system.joints[0].with_(elements=HingeElement(drive=curve))
    with pytest.raises(mp.InputError, match="joint 'shoulder': the drive is a table"):
        write_exudyn_script(system.with_(joints=(drive, system.joints[1])), tmp_path / "a.py")
    with pytest.raises(mp.InputError, match="ends in .py"):
        write_exudyn_script(system, tmp_path / "a.txt")
    assert not list(tmp_path.iterdir())
    assert lost_in_exudyn_script(system) == []
    stiffened = system.with_(bodies={"link": LINK, "arm": uniform_beam(modes=2)})
    assert lost_in_exudyn_script(stiffened)[0].startswith("body 'arm': geometric stiffness has no place")


def test_the_command_writes_a_script_of_a_system(tmp_path, capsys):
    mp.write_body(uniform_beam(modes=2), tmp_path / "beam.h5")
    file = tmp_path / "arm.toml"
    file.write_text(
        '[bodies.arm]\nfile = "beam.h5"\n[joints.hinge]\ntype = "revolute"\nchild = "arm.root"\n'
        "[environment]\ngravity = [0, -9.81, 0]\n[simulation]\nt_end = 0.5\noutput_step = 0.05\n"
    )
    assert main(["export", str(file), "--to", "exudyn", "--json"]) == 0
    assert "geometric stiffness has no place" in capsys.readouterr().out
    text = (tmp_path / "arm.py").read_text()
    assert "T_END = 0.5" in text
    assert "PERIOD = 0.05" in text
    assert (tmp_path / "arm-arm.npz").exists()


# --- MBDyn: cards split by the rules of its manual; there is no MBDyn to run them ----------------------------------


def cards(path):
    """Blocks of a deck: (head, arguments) of each card, which ends with a semicolon; commas separate arguments."""
    text = "".join(line for line in path.read_text().splitlines(True) if not line.startswith("#"))
    found, block = {}, None
    for card in (" ".join(each.split()) for each in text.split(";") if each.strip()):
        head, _, rest = card.partition(":")
        if head == "begin":
            block = found.setdefault(rest.strip(), [])
        elif head != "end":
            block.append((head.strip(), [word.strip() for word in rest.split(",")]))
    return found


def vector(words, at):
    return np.array(words[at : at + 3], dtype=float)


def matrix(words, at):
    assert words[at] == "matr"
    return np.array(words[at + 1 : at + 10], dtype=float).reshape(3, 3)


def ends_of(words, nodes):
    """The two ends of a total joint in the ground: place, and axes of its positions and of its rotations."""
    for at in (2, 29):
        assert [words[at + k] for k in (1, 5, 16)] == ["position", "position orientation", "rotation orientation"]
        position, R = nodes[int(words[at])]
        yield position + R @ vector(words, at + 2), R @ matrix(words, at + 6), R @ matrix(words, at + 17)


def active(words, kind):
    at = words.index(f"{kind} constraint")
    return np.array(words[at + 1 : at + 4]) == "active"


@pytest.mark.parametrize("make", [two_links, slider])
def test_a_deck_of_mbdyn_holds_the_system(make, tmp_path):
    """Counts of the cards, nodes where the bodies start, masses, and joints whose two ends agree in what they hold."""
    system = make()
    system = system.with_(joints=tuple(joint.with_(elements=()) for joint in system.joints))
    deck = cards(write_mbdyn_deck(system, tmp_path / "deck.mbd", t_end=2.0))
    control = {head: words for head, words in deck["control data"]}
    assert "use automatic differentiation" in control
    for key, kind in (("joints", "joint"), ("rigid bodies", "body"), ("forces", "force")):
        assert int(control[key][0]) == sum(head == kind for head, _ in deck["elements"])
    assert int(control["structural nodes"][0]) == len(deck["nodes"])
    nodes = {1: (np.zeros(3), np.eye(3))}
    for _, words in deck["nodes"][1:]:
        nodes[int(words[0])] = (vector(words, 2), matrix(words, 5))
    starts = start_of(system)
    masses = iter(state for state in starts.values() if not state.body.n)
    for head, words in deck["elements"]:
        if head == "body":
            state = next(masses)
            position, R = nodes[int(words[1])]
            assert_close([*position, *R.ravel()], [*state.p, *state.R.ravel()], 1e-14, scale=1.0)
            m, centre, J = float(words[2]), vector(words, 3), matrix(words, 6)
            about = J + m * (centre @ centre * np.eye(3) - np.outer(centre, centre))
            assert_close(about, np.trace(state.body.E0) * np.eye(3) - state.body.E0, 1e-12, scale=1.0)
        if head == "joint" and words[1] == "total joint":
            (a, A, turned), (b, _, other) = ends_of(words, nodes)
            gap = (A.T @ (b - a))[active(words, "position")]
            assert_close(gap, np.zeros(len(gap)), 1e-9, scale=1.0)
            held = active(words, "orientation")
            relative = turned.T @ other
            if held[:2].all():
                assert_close(relative[:, 2], [0, 0, 1], 1e-9)
            if held[2]:  # by a motion, which is zero at the start, or for ever
                assert_close(relative, np.eye(3), 1e-9)
    modal = [words for head, words in deck["elements"] if head == "joint" and words[1] == "modal"]
    assert len(modal) == sum(body.n > 0 for body in system.bodies.values())
    for words in modal:
        assert words[3:6] == ["8", "from file", "damping from file"]
        assert (tmp_path / words[6].strip('"')).exists()
        assert words[8:] == ['"tip"', words[9], "null"]
        root, R = nodes[int(words[2])]
        assert_close(nodes[int(words[9])][0], root + R @ [10.0, 0, 0], 1e-12)


def test_what_a_deck_of_mbdyn_cannot_carry_is_refused(tmp_path):
    system = two_links()
    with pytest.raises(mp.InputError, match="cannot carry springs, dampers and drives of joints: shoulder, elbow"):
        write_mbdyn_deck(system, tmp_path / "a.mbd")
    with pytest.raises(mp.InputError, match="ends in .mbd"):
        write_mbdyn_deck(system, tmp_path / "a.txt")
    assert not list(tmp_path.iterdir())
    assert lost_in_mbdyn_deck(system) == []
