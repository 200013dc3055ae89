"""The satellite: every element family in one model, against hand sums, identities and a finer mesh."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

import modalprep as mp
from modalprep.cli import main
from modalprep.pipeline.building.model import assemble_pipeline
from modalprep.pipeline.schema.load import load_pipeline

MODES = 20  # of those compared with the finer mesh: up to 36 Hz


@pytest.fixture(scope="module")
def script(project) -> dict:
    """Names of the script that makes the mesh."""
    return runpy.run_path(str(project / "meshes" / "satellite.py"))


@pytest.fixture(scope="module")
def pipeline(project):
    return load_pipeline(project / "pipelines" / "satellite.toml")


@pytest.fixture(scope="module")
def assembled(script, pipeline, tmp_path_factory):
    """Return ``assembled(groups)``, the model of the pipeline file on a mesh written and read again."""
    folder = tmp_path_factory.mktemp("satellite")

    def make(groups) -> mp.fe.FEModel:
        file = Path(folder / "satellite.msh")
        script["write"](file, groups)
        return assemble_pipeline(pipeline, mp.read_mesh(file))

    return make


@pytest.fixture(scope="module")
def model(project, pipeline) -> mp.fe.FEModel:
    """The bundled mesh."""
    return assemble_pipeline(pipeline, mp.read_mesh(project / "meshes" / "satellite.msh"))


@pytest.fixture(scope="module")
def reduction(model) -> mp.reduction.Reduction:
    return mp.craig_bampton(model, modes=MODES)


@pytest.fixture(scope="module")
def body(model, reduction) -> mp.body.FlexibleBody:
    return mp.flexible_body(model, reduction, name="satellite", damping=0.005)


@pytest.fixture(scope="module")
def fine(script, assembled) -> mp.fe.FEModel:
    """Cells half as long."""
    return assembled(script["satellite"](16))


@pytest.fixture(scope="module")
def fine_reduction(fine) -> mp.reduction.Reduction:
    return mp.craig_bampton(fine, modes=MODES, keep="effective_mass > 2%")


def free_frequencies(model: mp.fe.FEModel, n: int) -> np.ndarray:
    """Lowest n frequencies (Hz) of the free body, round-off of either sign included."""
    K, M = ((model.C.T @ A @ model.C).tocsr() for A in (model.K, model.M))
    w2, _, _ = mp.linalg.lowest_modes(K, M, n, shift=-((2 * np.pi) ** 2))
    return np.sqrt(np.abs(w2)) / (2 * np.pi)


def failed(checks) -> list:
    return [check for check in checks if not check.passed]


# --- the bundled mesh ---------------------------------------------------------------------------------------------


def test_bundled_mesh_is_what_the_script_writes(script, project, tmp_path):
    script["write"](tmp_path / "again.msh", script["satellite"](8))
    bundled = (project / "meshes" / "satellite.msh").read_bytes()
    assert (tmp_path / "again.msh").read_bytes() == bundled
    assert len(bundled) < 700_000


def test_mesh_has_no_flaw(project, capsys):
    assert main(["quality", str(project / "pipelines" / "satellite.toml")]) == 0
    assert "No errors, no warnings." in capsys.readouterr().out


def hand_mass(circle: float, dish: float, strut: float) -> float:
    """Sum of areas, lengths and volumes, kg; `circle` and `dish` are those of the facets."""
    aluminium, tube = 2700.0, 1600.0
    deck = 2 * (5e-4 * aluminium + 0.01 * 50) + 6
    side = 2 * (4e-4 * aluminium + 0.01 * 50) + 4
    wing = 2 * (2 * 1.5e-4 * 1580 + 0.011 * 16) + 1.2
    skins = 2 * (3 * 1.5e-4 * 1580 + 0.005 * 16)
    i_beam = 2 * 0.030 * 0.003 + 0.044 * 0.003
    shells = 2 * 2.25 * deck + 4 * 2.25 * side + 2.25 * (side - 4) + 2 * 8 * wing + dish * skins
    shells += circle * 0.25 * 0.003 * aluminium
    beams = aluminium * (12 * 1.5 * (0.03**2 - 0.026**2) + 2 * circle * 0.02 * 0.06)  # frame, ring
    beams += aluminium * i_beam * (4 * 1.5 + 4 * 0.375)  # stiffeners, brackets
    beams += aluminium * 2 * 0.1 * np.pi * (0.03**2 - 0.026**2)  # drives
    beams += tube * 4 * np.hypot(0.5, 0.35) * np.pi * (0.025**2 - 0.023**2)  # yokes
    beams += tube * 2 * 12 * (0.022**2 - 0.02**2)  # wing frames
    bars = tube * 1.5e-4 * (strut + 2 * 0.5)
    return shells + beams + bars + 0.375**2 * 0.3 * 900 + 100 + 2 * 8


def faceted(n: int) -> tuple[float, float, float]:
    """Length of the adapter's polygon, area of the dish's triangles, total length of its struts."""
    k, rings = 3 * n // 8, n // 2
    first = np.arctan(1 / 3)
    arcs = np.repeat([np.pi / 2 - 2 * first, 2 * first], 4)  # between bolts
    circle = k * np.sum(2 * np.hypot(0.5625, 0.1875) * np.sin(arcs / k / 2))

    def at(ring, angle):
        r = 0.6 * ring / rings
        return np.array([r * np.cos(angle), r * np.sin(angle), 1.85 + r**2 / 2])

    def triangle(a, b, c):
        return np.linalg.norm(np.cross(b - a, c - a)) / 2

    dish = 0.0
    for ring in range(1, rings + 1):  # one sector of six
        out = [at(ring, np.pi / 3 * j / ring) for j in range(ring + 1)]
        within = [at(ring - 1, np.pi / 3 * j / max(ring - 1, 1)) for j in range(ring)]
        dish += sum(triangle(out[j], out[j + 1], within[j]) for j in range(ring))
        dish += sum(triangle(within[j], out[j + 1], within[j + 1]) for j in range(ring - 1))
    heads = [at(rings / 2, turn) for turn in (0, 2 * np.pi / 3, 4 * np.pi / 3)]
    right, left, back = (np.array([x, y, 1.5]) for x, y in ((0.375, -0.375), (0.375, 0.375), (-0.375, 0.0)))
    pairs = zip((heads[0], heads[0], heads[1], heads[1], heads[2], heads[2]), (right, left, left, back, back, right),
                strict=True)  # fmt: skip
    return circle, 6 * dish, sum(np.linalg.norm(head - foot) for head, foot in pairs)


def test_mass_by_hand(model):
    assert model.rigid.m == pytest.approx(hand_mass(*faceted(8)), rel=1e-9)


def test_free_body_has_six_rigid_motions(model):
    f = free_frequencies(model, 10)
    assert np.all(f[:6] < 1e-3 * f[6])
    assert f[6] == pytest.approx(1.3, rel=0.5)


def test_checks_pass_and_there_are_no_notes(model, body):
    assert model.notes == ()
    assert failed(mp.body.check_model(model)) == []
    assert failed(mp.check_body(body)) == []
    assert body.interface_name == ("launcher", "antenna", "wing_tip")


def test_frequencies_of_the_pipeline_header(model, reduction):
    """What pipelines/satellite.toml promises."""
    f, mass = reduction.table.frequency, reduction.table.effective_mass / reduction.table.total
    assert model.rigid.m == pytest.approx(365.73, abs=0.01)
    assert f[:5] == pytest.approx([0.931, 0.932, 1.392, 1.394, 2.68], rel=2e-3)
    assert f[10] == pytest.approx(17.69, abs=0.05)
    assert mass[10, 0] == pytest.approx(0.54, abs=0.01)
    assert f[16] == pytest.approx(25.92, abs=0.05)
    assert mass[16, 1] == pytest.approx(0.60, abs=0.01)


def test_twenty_modes_driven_at_the_launcher_have_the_stated_error(model, body):
    """Reactions and motion of the wing tip at 5 and 20 Hz against all 5340 DOFs: 2e-7 and 2e-4; modes end at 36 Hz."""
    beta = 1e-4
    inputs = {"base.x": 1.0, "base.z": 2.0, "wing_tip.x": 3.0}
    options = {"damping": mp.reduction.Rayleigh(alpha=0.0, beta=beta), "refine": False}
    found = mp.response.harmonic_response(body, inputs, [5.0, 20.0], **options)
    C, rigid = csc_matrix(model.C), model.rigid_body() @ [1.0, 0, 2, 0, 0, 0]
    root, tip = np.searchsorted(model.free, model.interfaces[0].dofs), model.interfaces[2].dofs
    i, force = np.setdiff1d(np.arange(len(model.free)), root), np.zeros(model.n_dof)
    force[tip[0]] = 3.0
    for k, limit in enumerate((2e-7, 2e-4)):
        w = 2 * np.pi * found.axis[k]
        elastic = model.K * (1 + 1j * w * beta)
        Z = csc_matrix(C.T @ (elastic - w**2 * model.M) @ C)[i][:, i]
        x = np.zeros(len(model.free), dtype=complex)
        x[i] = splu(Z.tocsc()).solve((C.T @ (force - model.M @ rigid))[i].astype(complex))
        a = rigid - w**2 * (C @ x)
        reaction = (C.T @ (elastic @ (C @ x) + model.M @ a - force))[root]
        for name, vector in (("base.force", reaction[:3]), ("wing_tip.acceleration", a[tip[:3]])):
            values = np.array([found[f"{name}.{axis}"][k] for axis in "xyz"])
            assert values == pytest.approx(vector, rel=0, abs=limit * np.abs(vector).max())


def test_wings_move_in_pairs(reduction):
    """Two equal wings on a body much heavier: each of their modes comes twice, in phase and against it."""
    f = reduction.table.frequency
    for k in (0, 2, 4, 6, 8):
        assert f[k + 1] / f[k] - 1 < 2e-3
    assert np.all(f[2:10:2] / f[1:9:2] > 1.2)


# --- the fine mesh ------------------------------------------------------------------------------------------------


def test_fine_satellite_from_mesh_to_file(fine, fine_reduction, tmp_path):
    """20 thousand DOFs."""
    assert 15_000 < fine.n_dof < 30_000
    assert fine.notes == ()
    assert fine.rigid.m == pytest.approx(hand_mass(*faceted(16)), rel=1e-9)
    assert failed(mp.body.check_model(fine)) == []
    # the body of the bundled mesh has the second-order mass
    body = mp.flexible_body(fine, fine_reduction, name="fine", damping=0.005, second_order_mass=False)
    again = mp.read_body(mp.write_body(body, tmp_path / "fine.h5"))
    assert failed(mp.check_body(again)) == []
    for name in ("m", "s0", "E0", "S", "H", "P", "K", "Kg_W", "Kg_F", "shape"):
        assert np.array_equal(getattr(again, name), getattr(body, name)), name


def test_coarse_frequencies_are_near_those_of_the_fine_mesh(reduction, fine_reduction):
    """Linear shapes: a wave of wave number k in cells of h is off by ``(k h)^2 / 24``.

    At 36 Hz a wing's wave is 2.7 m long or eleven of its cells: 1.4 %. The beams that hold a wing bend the side panel
    from one line of nodes, which costs the first pair as much; no mode is off by more than 2 %.
    """
    coarse, fine = (r.table.frequency[:MODES] for r in (reduction, fine_reduction))
    assert np.abs(coarse / fine - 1).max() < 0.02
    assert np.abs(coarse / fine - 1).max() > 1e-3  # the meshes differ


# --- how the payload is joined ------------------------------------------------------------------------------------


def test_payload_on_an_edge_is_a_hidden_hinge(script, assembled, model):
    """The block moved up beyond the panel meets it only along the upper edge: shells and frame there turn freely."""
    groups = script["satellite"](8)
    groups["payload"] = groups["payload"] + [0, 0, 1.5 - groups["payload"][..., 2].min()]
    hinged = assembled(groups)
    notes = [note for note in hinged.notes if note.startswith("hidden hinge")]
    assert any("a shell meets a solid at 3 nodes around (0.75, 0, 1.5) m" in note for note in notes), hinged.notes
    assert any("a beam meets a solid at 3 nodes" in note for note in notes), hinged.notes
    f = free_frequencies(hinged, 8)
    assert np.all(f[:7] < 1e-3 * f[7])  # one motion more without strain
    assert hinged.rigid.m == pytest.approx(model.rigid.m, rel=1e-12)


# --- the stiffened panel ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("offset", "expected"), [(-0.0135, 14.78), (0.0, 9.59)])
def test_panel_bends_as_one_section(project, offset, expected):
    """Lowest frequency of the pipeline's header, and of a cantilever beam of skin and stiffeners within 1 %."""
    pipeline = load_pipeline(project / "pipelines" / "panel.toml")
    beams = pipeline.properties["stiffeners"]
    assert beams.offset == [0, -0.0135]
    changed = {**pipeline.properties, "stiffeners": beams.model_copy(update={"offset": [0.0, offset]})}
    mesh = mp.read_mesh(project / "meshes" / "panel.msh")
    model = assemble_pipeline(pipeline.model_copy(update={"properties": changed}), mesh)
    assert [frame.name for frame in model.interfaces] == ["root", "tip"]
    f = mp.craig_bampton(model, modes=4).table.frequency[0]
    assert f == pytest.approx(expected, abs=0.01)
    skin, web, I_beam = 0.8 * 0.002, 4 * (0.025 * 0.020 - 0.021 * 0.018), (0.020 * 0.025**3 - 0.018 * 0.021**3) / 12
    mean = web * offset / (skin + web)
    EI = 70e9 * (0.8 * 0.002**3 / 12 + skin * mean**2 + 4 * I_beam + web * (offset - mean) ** 2)
    assert model.rigid.m == pytest.approx(2700 * 1.2 * (skin + web), rel=1e-12)
    assert f == pytest.approx(1.8751**2 / (2 * np.pi * 1.2**2) * np.sqrt(EI / (2700 * (skin + web))), rel=0.01)


def test_water_on_the_panel_lowers_its_bending(project):
    """Lowest frequency and mass of the header of tank-floor.toml, and those of a beam with the mass of the water."""
    pipeline = load_pipeline(project / "pipelines" / "tank-floor.toml")
    model = assemble_pipeline(pipeline, mp.read_mesh(project / "meshes" / "panel.msh"))
    f = mp.craig_bampton(model, modes=4).table.frequency[:2]
    assert f == pytest.approx([7.54, 7.67], abs=0.01)
    water = 1000 * 0.02 * 0.8  # kg/m
    dry = (model.rigid.m - 1.2 * water) / 1.2
    assert model.rigid.m == pytest.approx(25.97, abs=0.01)
    assert f[0] == pytest.approx(14.83 * np.sqrt(dry / (dry + water)), rel=0.01)
