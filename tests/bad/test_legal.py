"""Random legal values of pipeline files: a right result, or one sentence; never a hang, a warning, NaN or half a file.

`MODALPREP_FULL=10` makes ten times as many cases as the full size has, and others each time.
"""

import io
import warnings
from contextlib import redirect_stderr, redirect_stdout

import numpy as np
import pytest
import tomli_w
from bad import good
from bad.legal import SELDOM, number, table
from bad.test_fuzz import bounded, finite
from compare import assert_close
from hypothesis import given
from hypothesis import strategies as st

import modalprep as mp
from modalprep.cli import main
from modalprep.multibody.integration import endless
from modalprep.multibody.results.validity import failures
from modalprep.pipeline.schema import fe, force_elements, properties, reduction, system

SIZE = st.floats(-3, 3).map(lambda x: 10.0**x)  # m; others are plausible to nobody, and everyday numbers mostly
NU = st.integers(-90, 49).map(lambda x: x / 100)
DENSITY = number(above=0.0)
MATERIAL = {"E": number(above=0.0), "nu": NU, "rho": DENSITY}
TIES = st.sampled_from(["rbe2", "rbe3"])
ROUND_OFF = 1e-8  # of sums over a mesh of a few elements, and of the lever arms that they are moved by


class Mesh:
    """A straight mesh of a few cells from the plane x = 0 on, as an Abaqus deck: groups part, root and tip."""

    def __init__(self, kind, sizes, cells):
        self.kind, self.sizes, self.cells = kind, sizes, cells
        counts = {"B31": (cells, 0, 0), "S4R": (cells, 1, 0), "C3D8": (cells, 1, 1)}[kind]
        axes = [
            np.linspace(0, size, count + 1) if count else np.zeros(1) for size, count in zip(sizes, counts, strict=True)
        ]
        self.points = np.array([(x, y, z) for x in axes[0] for y in axes[1] for z in axes[2]])
        step = len(axes[1]) * len(axes[2])
        corners = {"B31": [0, 1], "S4R": [0, 2, 3, 1], "C3D8": [0, 4, 6, 2, 1, 5, 7, 3]}[kind]
        self.rows = [[k * step + c + 1 for c in corners] for k in range(cells)]

    def text(self):
        nodes = [f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(self.points.tolist(), start=1)]
        cells = [f"{k}, {', '.join(map(str, row))}" for k, row in enumerate(self.rows, start=1)]
        sets = {"root": self.points[:, 0] == 0, "tip": self.points[:, 0] == self.points[:, 0].max()}
        lines = ["*NODE", *nodes, f"*ELEMENT, TYPE={self.kind}, ELSET=part", *cells]
        for name, at in sets.items():
            lines += [f"*NSET, NSET={name}", *(str(k + 1) for k in np.flatnonzero(at))]
        return "\n".join(lines)


@st.composite
def section(draw):
    """Numbers of the section of a beam, from a thin ribbon to a square."""
    A = draw(SIZE) ** 2
    return {"A": A} | {name: A**2 * 10.0 ** draw(st.floats(-4, -1)) for name in ("Iy", "Iz", "J")}


@st.composite
def bodies(draw, kind):
    """A pipeline file of a body with its mesh."""
    mesh = Mesh(kind, [draw(SIZE) for _ in range(3)], draw(st.integers(1, 3)))
    part = {
        "B31": table(
            properties.BeamTable, type="beam", material="stuff", without=("section", "up", "offset"), **draw(section())
        ),
        "S4R": table(
            properties.ShellTable, type="shell", material="stuff", thickness=number(above=0.0), without=("plies",)
        ),
        "C3D8": table(properties.SolidTable, type="solid", material="stuff"),
    }[kind]
    end = table(
        fe.InterfaceTable, without=("node", "near", "box", "plane", "cylinder", "position"), group="tip", kind=TIES
    )
    file = {
        "mesh": {"file": "part.inp"},
        "materials": {"stuff": draw(table(properties.MaterialTable, type="isotropic", **MATERIAL))},
        "properties": {"part": draw(part)},
        "interfaces": {"root": {"group": "root"}} | ({"tip": draw(end)} if draw(st.booleans()) else {}),
        "reduction": draw(table(reduction.ReductionTable, without=("keep", "truncation_vectors", "root"))),
        "output": {"pictures": "none"},
    }
    return mesh, file


def run(folder, *arguments):
    """Run a command; return its exit code, after a look at what it said and wrote."""
    said, error = io.StringIO(), io.StringIO()
    with redirect_stdout(said), redirect_stderr(error), warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", RuntimeWarning)  # as the command line does
        code = main([*map(str, arguments), "--output", str(folder / "output")])
    assert not seen, [str(each.message) for each in seen]
    assert code in (0, 1, 2), said.getvalue()
    assert error.getvalue().count("\n") == bool(code), error.getvalue()
    assert error.getvalue().startswith("modalprep: ") or not code
    assert not [path.name for path in (folder / "output").rglob("*") if path.is_file() and not finite(path)]
    return code, error.getvalue()


def closed_form(mesh, file):
    """Return mass, centre and second moments of mass (3, 3) about the root of a body, in its axes, SI."""
    L, b, c = mesh.sizes
    rho, part = file["materials"]["stuff"]["rho"], file["properties"]["part"]
    if mesh.kind == "C3D8":
        m = rho * L * b * c
        return m, np.array([L / 2, 0, 0]), m * np.diag([L**2 / 3, b**2 / 12, c**2 / 12])
    if mesh.kind == "S4R":
        t, more, o = part["thickness"], part.get("nsm", 0.0), part.get("offset", 0.0)
        m = (rho * t + more) * L * b
        centre, own = np.array([L / 2, 0, o]), np.diag([m * L**2 / 12, m * b**2 / 12, rho * t**3 / 12 * L * b])
        return m, centre, own + m * np.outer(centre, centre)
    m = (rho * part["A"] + part.get("nsm", 0.0)) * L
    across = rho * L * np.diag([0, part["Iz"], part["Iy"]])
    return m, np.array([L / 2, 0, 0]), m * np.diag([L**2 / 3, 0, 0]) + across


def right(body, mesh, file):
    """Compare a body with what its mesh and its tables say in closed form."""
    m, centre, second = closed_form(mesh, file)
    assert_close(body.m, m, ROUND_OFF)
    assert_close(body.s0, m * centre, ROUND_OFF)
    assert_close(body.E0, second, ROUND_OFF)
    assert np.all(np.isfinite(body.frequency))
    assert np.all(body.frequency >= 0)


@pytest.mark.parametrize("kind", ["B31", "S4R", "C3D8"])
@bounded(12)
@given(data=st.data())
def test_bodies(tmp_path_factory, kind, data):
    folder = tmp_path_factory.mktemp("legal")
    mesh, file = data.draw(bodies(kind))
    (folder / "part.inp").write_text(mesh.text())
    (folder / "job.toml").write_text(tomli_w.dumps(file))
    code, _ = run(folder, "modes", folder / "job.toml")
    if code == 0:
        right(mp.read_body(folder / "output" / "job" / "job.h5"), mesh, file)


ENDS = {"root": [0.0, 0.0, 0.0], "tip": [1.0, 0.0, 0.0]}
HINGE = ("motion", "force", "torque", "rotation", "second_axis", "position", "pitch", "keep_start")
ELEMENTS = {  # one value for each coordinate
    "stiffness": number(low=0.0),
    "free_position": number(),
    "damping": number(low=0.0),
    "friction": st.one_of(number(low=0.0), table(system.FrictionTable)),
    "limits": table(system.LimitsTable),
}
CURVES = ("characteristic", "damping_characteristic", "rotation")
COORDINATES = {"revolute": 1, "prismatic": 1, "cylindrical": 2, "planar": 3, "spherical": 0, "free": 0, "weld": 0}
LAWS = st.one_of(number(), st.sampled_from(["sin(3*t)", "2*t", "exp(-t)*cos(100*t)"]))
THREE = st.lists(LAWS, min_size=3, max_size=3)


@st.composite
def rigid(draw):
    """A rigid body with an inertia that is possible."""
    a, b, c = (abs(draw(number())) for _ in range(3))
    return draw(
        table(
            system.BodyTable,
            without=("file", "pipeline"),
            mass=number(above=0.0),
            inertia=[a + b, b + c, c + a],
            interfaces=ENDS,
        )
    )


def start(kind):
    """Start values that a joint of this type has."""
    own = {"revolute": ("angle", "rate"), "prismatic": ("displacement", "speed")}
    own["cylindrical"] = (*own["revolute"], *own["prismatic"])
    return st.fixed_dictionaries({}, optional={name: number() for name in own.get(kind, ())})


@st.composite
def joints(draw, parent, child):
    """A joint with elements on each of its coordinates."""
    kind = draw(st.sampled_from(sorted(COORDINATES)))
    count = COORDINATES[kind]
    given = {
        name: st.lists(each, min_size=count, max_size=count)
        for name, each in ELEMENTS.items()
        if count and draw(st.booleans())
    }
    joint = draw(
        table(system.JointTable, without=(*HINGE, *ELEMENTS), type=kind, start=start(kind), parent=parent, child=child)
    )
    each = {name: draw(values) for name, values in given.items()}
    return joint | each | ({"second_axis": [0.0, 1.0, 0.0]} if kind == "planar" else {})


@st.composite
def systems(draw):
    """A pipeline file of one or two bodies on joints, with force elements: a short run of it."""
    flexible = draw(st.sampled_from(SELDOM))
    file = {"bodies": {"arm": {"file": "body.h5"} if flexible else draw(rigid()), "bob": draw(rigid())}}
    file["joints"] = {"hip": draw(joints("ground", "arm.root")), "knee": draw(joints("arm.tip", "bob.root"))}
    ends = st.sampled_from([["ground", "bob.tip"], ["arm.root", "bob.tip"], ["arm.tip", "ground"]])
    tables = {
        "forces": table(
            force_elements.ForceTable, without=("body", "box", "factor"), at="arm.tip", force=THREE, torque=THREE
        ),
        "springs": table(force_elements.AxialSpringTable, between=ends, without=("actuator_force",)),
        "bushings": table(force_elements.BushingTable, between=ends, without=("rotation", "free_rotation")),
        "rotational_springs": table(force_elements.RotationalSpringTable, between=ends, without=CURVES),
    }
    file |= {name: {"push": draw(each)} for name, each in tables.items() if draw(st.booleans())}
    file["environment"] = {"gravity": draw(st.lists(number(), min_size=3, max_size=3))}
    t_end = 10.0 ** draw(st.floats(-5, 0))
    plain = ("variables", "output", "compare_conventional", "rtol")
    run = table(system.SimulationTable, without=plain, t_end=t_end, output_step=t_end / 20)
    return file | {"simulation": draw(run)}


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    """Good files; runs of more than some seconds count as endless, and end with the sentence of those."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(endless, "EVALUATIONS", 5000)
        patch.setattr(endless, "ENDLESS", 5e5)
        yield good.write_good(tmp_path_factory.mktemp("good"))


@bounded(25)
@given(data=st.data())
def test_systems(originals, data):
    file = data.draw(systems())
    (originals / "case.toml").write_text(tomli_w.dumps(file))
    code, _ = run(originals, "simulate", originals / "case.toml", "-o", originals / "output" / "case.h5")
    if code == 0:
        balanced(mp.read_result(originals / "output" / "case.h5"), file)


def balanced(found, file):
    """Look at a run that is said to be right: it reaches its end, its energies balance, every number is one."""
    assert found.status == "done"
    assert found.time[-1] == pytest.approx(file["simulation"]["t_end"])
    assert not failures(
        found, file["simulation"].get("rtol", 1e-5), sum(b.get("mass", 0.0) for b in file["bodies"].values())
    )
    assert all(np.all(np.isfinite(values)) for values in found.table().values())
