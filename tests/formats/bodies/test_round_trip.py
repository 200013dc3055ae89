"""Every exported format: the body comes back, and moves as before within what the format does not hold."""

import re

import numpy as np
import pytest
from compare import assert_close
from multibody.trees import with_dampers
from size import FULL, seeds

import modalprep as mp
from modalprep.body.difference import compare_bodies
from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.formats import export_body, import_body
from modalprep.formats.bodies.read import FORMATS, NO_BODY
from modalprep.formats.export import EXPORTS, MATRICES, MOTION
from modalprep.pipeline.building.build import build_body
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.read import system_of

P_ALONE = {"mass integrals", "geometric stiffness of accelerations"}
KG = {"geometric stiffness of accelerations", "geometric stiffness of interface loads"}
SECOND = "second order of the modal mass"  # T
LINEAR = frozenset({*KG, SECOND, "mass integrals", "inertia coupling"})  # not held by matrices
NOT_HELD = {
    "sid": {*P_ALONE, SECOND},
    "mbdyn": {SECOND},
    "exudyn": {*KG, SECOND, "damping"},
    **dict.fromkeys(("op4", "nastran", "dmig"), LINEAR),
}
TOLERANCE = {"dmig": 1e-8}  # ten digits; all others 1e-9
SPIN_UP = {  # until 4 s, of the largest deflection of the tip, and the value that was measured
    "sid": 1e-6,  # 5e-8
    "mbdyn": 1e-6,  # 1e-9
    "exudyn": 0.04,  # 3.1e-2: without geometric stiffness
    "op4": 0.01,  # 7.6e-3: with that of the mean rotation
    "dmig": 0.01,  # 7.6e-3
}
PENDULUM = {  # angle of the upper hinge, and deflection of the elbow, whose vibration the damping decides
    "sid": (1e-8, 5e-4),  # below the first; the second is error of the integration
    "mbdyn": (1e-8, 5e-4),  # 1.2e-10, 8e-5 at rtol = 1e-9: error of the integration
    "exudyn": (2e-6, 0.2),  # 6.1e-7, 0.14: damping
    "op4": (2e-6, 0.02),  # 4.8e-7, 1.1e-2: H and P
    "dmig": (2e-6, 0.02),  # 4.8e-7, 1.1e-2
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("bodies")


@pytest.fixture(scope="module")
def beam(project, folder):
    return build_body(project / "pipelines" / "spinup-beam.toml", folder, Reporter(quiet=True)).body


@pytest.fixture(scope="module")
def link(project, folder):
    return build_body(project / "pipelines" / "bracket.toml", folder, Reporter(quiet=True)).body


def back(body, to, folder):
    """The body read from its file, with the names of the interfaces, which OUTPUT4 files do not hold."""
    found = import_body(export_body(body, to, folder / f"{to}-{body.name}{EXPORTS[to].suffix}"))
    return found.with_(interface_name=body.interface_name)


def test_every_exported_format_is_read_or_says_why_not():
    read = {suffix for known in FORMATS for suffix in known.suffixes}
    assert set(NOT_HELD) == {name for name, export in EXPORTS.items() if _comes_back(export)}
    for export in EXPORTS.values():
        assert (export.suffix in read) == _comes_back(export)
        assert (export.suffix in NO_BODY) != _comes_back(export)


def _comes_back(export):
    return export.read and export.holds in (MOTION, MATRICES)


@pytest.mark.parametrize("to", NOT_HELD)
@pytest.mark.parametrize("name", ["beam", "link"])
def test_what_the_format_holds_comes_back(name, to, request, folder):
    body = request.getfixturevalue(name)
    for check in compare_bodies(body, back(body, to, folder), TOLERANCE.get(to, 1e-9)):
        assert check.passed or check.name in NOT_HELD[to], check


@pytest.mark.parametrize("to", ["sid", "mbdyn", "op4", "dmig"])
def test_damping_between_modes_comes_back(to, folder):
    """To the digits of the formats, 12 to 17, of sums over six motions of each interface in matrices."""
    body = with_dampers(uniform_beam(modes=4, truncation=("interfaces", "inertia"))).with_(name="damped")
    found = import_body(export_body(body, to, folder / f"damped-{to}{EXPORTS[to].suffix}"))
    sign = np.sign(np.sum(found.phi * body.phi + found.psi * body.psi, axis=(0, 1)))
    size = np.sqrt(np.outer(body.D, body.D)).max()
    assert_close(found.damping_matrix * np.outer(sign, sign), body.damping_matrix, 1e-7, scale=size)
    assert_close(np.diag(found.damping_matrix), found.D, 1e-15)


def run(project, file, bodies, t_end):
    source = load(project / "pipelines" / file)
    step = source.pipeline.simulation.output_step
    system = system_of(source, bodies)
    return mp.simulate(system, t_end, output_step=step, rtol=3e-9).channels  # vibrations below the tolerance differ


def difference(found, expected):
    return np.abs(found - expected).max() / np.abs(expected).max()


@pytest.fixture(scope="module")
def spun(project, beam):
    return run(project, "spinup-beam.toml", {"beam": beam}, 4.0)["beam.tip.deflection"]


@pytest.mark.parametrize("to", SPIN_UP)
def test_spin_up_is_the_same_motion(to, project, beam, spun, folder):
    found = run(project, "spinup-beam.toml", {"beam": back(beam, to, folder)}, 4.0)["beam.tip.deflection"]
    assert difference(found, spun) < SPIN_UP[to]


@pytest.fixture(scope="module")
def swung(project, link):
    return run(project, "bracket-pendulum.toml", {"upper": link, "lower": link}, 1.0)


@pytest.mark.parametrize("to", PENDULUM if FULL else ["sid", "exudyn", "dmig"])
def test_pendulum_is_the_same_motion(to, project, link, swung, folder):
    body = back(link, to, folder)
    found = run(project, "bracket-pendulum.toml", {"upper": body, "lower": body}, 1.0)
    for channel, bound in zip(("shoulder.angle", "upper.bolt_b.deflection"), PENDULUM[to], strict=True):
        assert difference(found[channel], swung[channel]) < bound, channel


def test_damping_of_exudyn_is_added(project, link, swung, folder):
    """With that of the body the rest of the difference is T, as in MBDyn's file, and geometric stiffness."""
    body = back(link, "exudyn", folder).with_(D=link.D)
    found = run(project, "bracket-pendulum.toml", {"upper": body, "lower": body}, 1.0)
    assert difference(found["upper.bolt_b.deflection"], swung["upper.bolt_b.deflection"]) < 0.01


# --- damaged files ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("to", [name for name in NOT_HELD if name != "nastran"])
@pytest.mark.parametrize("seed", seeds(10))
def test_damaged_files_are_one_sentence(to, seed, tmp_path, capsys):
    """Cut files, lost and changed bytes: exit code 2 with one sentence and nothing written, or a body."""
    rng = np.random.default_rng(seed)
    file = export_body(uniform_beam(modes=2, truncation=("interfaces",)), to, tmp_path / f"beam{EXPORTS[to].suffix}")
    content = bytearray(file.read_bytes())
    if seed % 3 == 0:
        del content[rng.integers(len(content)) :]
    elif seed % 3 == 1:
        at = rng.integers(len(content))
        del content[at : at + rng.integers(1, 200)]
    else:
        for at in rng.integers(len(content), size=4):
            content[at] = rng.choice([*b"0123456789-=.(),DE \n\xff"])
    file.write_bytes(content)
    code = main(["import", str(file)])
    said = capsys.readouterr().err
    assert code in (0, 2)
    assert said.count("\n") == (code == 2), said
    assert code == 0 or re.match(r"modalprep: .*beam\.", said)
    written = {path.name for path in tmp_path.iterdir() if not path.name.startswith(".")}
    assert written == {file.name, *(["beam.h5"] if code == 0 else [])}


@pytest.mark.parametrize("to", [name for name in NOT_HELD if name != "nastran"])
def test_empty_files_are_refused(to, tmp_path, capsys):
    file = tmp_path / f"beam{EXPORTS[to].suffix}"
    file.write_bytes(b"")
    assert main(["import", str(file)]) == 2
    assert capsys.readouterr().err.startswith("modalprep: ")


@pytest.mark.parametrize("share", [0.9, 0.5, 0.1])  # from 0.25 on, the second moment about the centre is negative
@pytest.mark.parametrize("to", ["sid", "mbdyn", "exudyn"])
def test_inertia_too_small_for_the_modes_is_refused(beam, to, share, folder):
    """A share of the body's second moments: the mass matrix of the integrals has a negative eigenvalue."""
    file = export_body(beam.with_(E0=share * beam.E0), to, folder / f"light{EXPORTS[to].suffix}")
    with pytest.raises(mp.InputError, match="mass matrix of rigid motions and modes has the negative eigenvalue -"):
        import_body(file)
