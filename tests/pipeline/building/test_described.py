"""What the page of a body says of its inputs: masses and energies of groups sum up to those of the model."""

import numpy as np
import pytest

from modalprep.body.build import flexible_body
from modalprep.cli import main
from modalprep.fe.properties.materials import Material, Orthotropic3D
from modalprep.fe.properties.properties import Ply, Shell, Solid
from modalprep.fe.readers.read import read_mesh
from modalprep.pipeline.building.described import mass_table, material_table, model_tables, rigid_table, section_table
from modalprep.pipeline.building.energies import MOST_GROUPS, OTHERS, energy_tables
from modalprep.pipeline.building.model import checked_model, pipeline_sections
from modalprep.pipeline.schema.load import load_pipeline
from modalprep.reduction.craig_bampton import craig_bampton


@pytest.fixture(scope="module")
def pipeline(project):
    return load_pipeline(project / "pipelines" / "satellite.toml")


@pytest.fixture(scope="module")
def mesh(project):
    """Shells, beams, bars, bricks, springs and point masses."""
    return read_mesh(project / "meshes" / "satellite.msh")


@pytest.fixture(scope="module")
def checked(pipeline, mesh):
    return checked_model(pipeline, mesh)


@pytest.fixture(scope="module")
def energies(checked):
    model = checked[0]
    reduction = craig_bampton(model, modes=6)
    return energy_tables(model, reduction, flexible_body(model, reduction, name="satellite", second_order_mass=False))


def test_masses_of_the_groups_sum_up_to_that_of_the_assembled_matrix(checked, pipeline):
    model = checked[0]
    table = mass_table(model, pipeline_sections(pipeline))
    masses = [row[4] for row in table.rows]
    assembled, difference = table.below[0][4], table.below[1][4]
    assert table.total[4] == pytest.approx(sum(masses), rel=1e-14)
    assert table.total[4] == pytest.approx(model.rigid.m, rel=1e-12)
    assert abs(difference) < 1e-12 * assembled  # sums of 1e4 positive terms
    assert table.total[5] == pytest.approx(100)
    # by hand: the payload's bricks of 900 kg/m^3; the tank and two wheels of the file
    by = {row[0]: row for row in table.rows}
    assert by["payload"][4] == pytest.approx(900 * by["payload"][3], rel=1e-12)
    assert [by[name][4] for name in ("tank", "wheel_a", "wheel_b")] == [100, 8, 8]


@pytest.mark.parametrize("distribution", ["coupled", "lumped", "nastran"])
def test_kinetic_and_strain_energy_of_the_groups_are_those_of_the_matrices(pipeline, mesh, distribution):
    """Of random displacements of every DOF, against the assembled matrices."""
    table = pipeline.mesh.model_copy(update={"mass": distribution})
    model = checked_model(pipeline.model_copy(update={"mesh": table}), mesh)[0]
    Phi = np.random.default_rng(1).standard_normal((model.n_dof, 3))
    kinetic = model.groups.modal_mass(Phi)
    np.testing.assert_allclose(kinetic.sum(axis=0), np.einsum("ij,ij->j", Phi, model.M @ Phi), rtol=1e-11)
    assert np.all(kinetic >= 0)
    strain = model.groups.summed(model.strain_energy(Phi)).sum(axis=0)
    np.testing.assert_allclose(2 * strain, np.einsum("ij,ij->j", Phi, model.K @ Phi), rtol=1e-6)  # float32


def test_shares_of_each_mode_sum_up_to_all_of_it(energies):
    for table, tolerance in zip(energies, (1e-4, 1e-8), strict=True):  # strain energy is stored as float32
        assert table.columns[-1] == "sum"
        shares = np.array([row[2:-1] for row in table.rows], dtype=float)
        assert np.all(shares > -1e-9)
        np.testing.assert_allclose(shares.sum(axis=1), [row[-1] for row in table.rows])
        np.testing.assert_allclose(shares.sum(axis=1), 100, atol=tolerance)


def test_wings_have_the_kinetic_energy_of_the_lowest_modes(energies):
    """pipelines/satellite.toml: the wings bend at 0.93 Hz, sway at 1.39 Hz and twist at 2.68 Hz."""
    kinetic = energies[1]
    for row in kinetic.rows[:6]:
        assert sum(row[kinetic.columns.index(name)] for name in ("wings", "wing_frame", "yoke")) > 99


def test_small_groups_are_summed_up(energies, checked):
    assert len(checked[0].groups.names) > MOST_GROUPS
    for table in energies:
        assert len(table.columns) == MOST_GROUPS + 3
        assert table.columns[-2] == OTHERS


def test_tables_hold_what_the_file_says(pipeline, mesh, checked):
    tables = {table.name: table for table in model_tables(pipeline, mesh, *checked)}
    assert list(tables) == [
        "model", "materials", "properties", "mass-by-group", "elements", "links", "interfaces", "rigid-body-motions",
    ]  # fmt: skip
    materials = {row[0]: row for row in tables["materials"].rows}
    assert set(materials) == set(pipeline.materials)
    assert materials["aluminium"][tables["materials"].columns.index("E (GPa)")] == 70
    numbers = {row[0]: row[1] for row in tables["elements"].rows}
    assert numbers == {kind: len(cells) for kind, cells in checked[0].cells.items() if kind != "vertex"}
    assert [row[0] for row in tables["interfaces"].rows] == [frame.name for frame in checked[0].interfaces]
    assert tables["interfaces"].rows[0][1] == "root"


def test_rigid_motions_of_a_free_model_have_no_frequency_and_a_spring_to_ground_shows(checked):
    model = checked[0]
    assert max(row[1] for row in rigid_table(model).rows) < 1e-3
    diagonal = np.zeros(model.n_dof)
    diagonal[model.dof[0, 2]] = 1e4 * model.rigid.m  # 15.9 Hz if all the mass were on it
    from scipy.sparse import diags_array

    held = model.with_(K=(model.K + diags_array(diagonal)).tocsr())
    assert max(row[1] for row in rigid_table(held).rows) > 5


def test_materials_of_solids_and_of_decks_have_all_their_constants():
    wood = Orthotropic3D(E1=11e9, E2=1e9, E3=1e9, nu12=0.3, nu13=0.3, nu23=0.4, G12=1e9, G13=1e9, G23=0.1e9, rho=500.0)
    table = material_table({"wood": wood, "steel": Material(E=210e9, nu=0.3, rho=7800.0)})
    assert table.columns[2:-1] == (*(f"{name} (GPa)" for name in "E E1 E2 E3 G G12 G13 G23".split()),
                                   "nu", "nu12", "nu13", "nu23")  # fmt: skip
    assert [row[-1] for row in table.rows] == [500.0, 7800.0]


def test_dimensions_have_units():
    steel = Material(E=210e9, nu=0.3, rho=7800.0)
    rows = section_table(
        {"skin": Shell(plies=(Ply(material=steel, thickness=1e-3, angle=np.pi / 4),), nsm=2.0),
         "block": Solid(material=steel)}, {"steel": steel},
    ).rows  # fmt: skip
    assert rows[0] == ("skin", "shell", "steel", "1 plies, 1 mm: 1 mm at 45°, nsm 2 kg/m²")
    assert rows[1][2:] == ("steel", "")


@pytest.fixture(scope="module")
def page(project, tmp_path_factory):
    """The page of `modalprep modes`, and that of the same body from the cache."""
    from modalprep.pipeline.building.build import build_body
    from modalprep.pipeline.building.cache import Cache
    from modalprep.pipeline.console import Reporter

    folder, path = tmp_path_factory.mktemp("page"), project / "pipelines" / "spinup-beam.toml"
    cache = Cache(folder / "cache")
    built = [build_body(path, folder / name, Reporter(quiet=True), cache) for name in ("first", "again")]
    assert main(["modes", str(path), "--output", str(folder), "--json"]) == 0
    return built, (folder / "spinup-beam" / "spinup-beam-modes.html").read_text(encoding="utf-8")


def test_page_has_inputs_hashes_versions_and_the_text_of_the_file(page, project):
    from modalprep.program import file_digest, program

    text = page[1]
    path = project / "pipelines" / "spinup-beam.toml"
    assert file_digest(path) in text
    assert program()["sources_sha256"] in text
    for words in ("<summary>Pipeline file</summary>", "Mass by group", "kinetic-energy.csv", "[reduction]", "host"):
        assert words in text


def test_cached_body_has_the_same_tables(page):
    first, again = (
        [[table.csv() for table in part] for part in built.tables] for built in page[0]
    )  # floats are the same to the last bit
    assert first == again
    assert len(first[0]) > 5
    assert len(first[1]) == 2


def test_modal_file_alone_says_what_is_missing(page, tmp_path):
    assert main(["modes", str(page[0][0].file), "--output", str(tmp_path), "--json"]) == 0
    text = (tmp_path / "spinup-beam-modes.html").read_text(encoding="utf-8")
    assert "A modal file alone does not hold materials" in text
