"""Who may import whom: packages and their folders are layers, and nothing imports from a layer above its own."""

import ast
import graphlib
import subprocess
import sys
from functools import cache

import pytest

BASE = {
    "errors", "extras", "records", "suggest", "atomic", "vectors", "compiler", "lazy", "notebook",
    "drawing", "labelled", "program", "workers", "applies", "verdicts",
}  # fmt: skip
MAY_IMPORT = {
    "verdicts": BASE,
    "compiler": BASE,
    "workers": BASE,
    "linalg": BASE,
    "fe": BASE | {"linalg"},
    "reduction": BASE | {"linalg", "fe"},
    "body": BASE | {"linalg", "fe", "reduction"},
    "supplied": BASE | {"linalg", "fe", "reduction", "body"},
    "multibody": BASE | {"body"},
    "formats": BASE | {"linalg", "fe", "body", "reduction", "supplied", "multibody", "response"},
    "ensemble": BASE | {"multibody", "formats"},
    "sensitivity": BASE | {"body", "multibody", "ensemble", "formats"},
    "runtime": BASE | {"multibody", "examples"},
    "correlation": BASE | {"body", "fe", "linalg"},
    "response": BASE | {"body", "reduction"},
    "report": BASE
    | {"correlation", "response", "fe", "body", "reduction", "multibody", "formats", "ensemble", "sensitivity"},
    "pipeline": BASE
    | {"body", "correlation", "ensemble", "fe", "formats", "linalg", "multibody", "reduction", "report"}
    | {"response", "runtime", "sensitivity", "supplied"},
}
# The folders of a package, and the files beside them, from the lowest to the highest.
LAYERS = {
    "fe": (
        "properties", "mesh", "links", "features", "quality", "elements", "elements.shells", "families",
        "readers.coverage", "readers.numbers", "readers.text", "readers.units", "readers.loads", "readers.systems",
        "readers.entries", "readers.matrix_elements", "readers.output4",
        "readers.nastran", "readers.abaqus", "readers.ansys",
        "readers", "generation", "forms", "assembly", "terms", "assembly.assemble", "division",
        "recovery", "sensitivity", "external",
    ),
    "multibody": (
        "model.functions", "model", "kernels.algebra", "kernels.stations", "kernels.joints", "kernels",
        "kernels.closed_loops", "kernels.loads", "kernels.tangents", "packing", "tangents", "elements", "evaluation",
        "reference",
        "integration.events", "integration", "results", "checkpoints", "preparation", "compilation", "analysis",
        "control", "rotors", "starts", "simulate", "free_body", "deploying",
    ),
    "report": (
        "terminal", "numbers", "tables", "scene", "pictures", "painter", "viewer", "check_tables",
        "schema_tables", "mac", "charts", "responses", "strength", "summary", "linear", "analysis", "synthesis",
        "ensemble", "rotor", "body_page", "explain", "correlation", "cyclic", "page", "run_page", "view",
        "study", "show",
    ),
    "pipeline": (
        "bar", "console", "schema.base", "schema.quantities", "schema.columns", "schema.time", "schema.fe",
        "schema.reduction", "schema.responses", "schema", "building", "systems", "responses", "film", "view",
        "fmu", "exporting", "drawn", "pictures", "outcome", "pages", "run", "study", "batch", "init",
    ),
}  # fmt: skip
ONLY_IN = {  # third parties with one home
    "skfem": {"fe"},
    "meshio": {"fe"},
    "gmsh": {"fe"},
    "numba": {"compiler", "runtime"},
    "pyvista": {"report.pictures", "report.show", "report.painter"},
    "matplotlib": {"report"},
    "pydantic": {"pipeline"},
    "symengine": {"multibody"},
    "h5py": {"formats", "fe.readers"},
    "tomli_w": {"pipeline"},
    "psutil": {"linalg", "workers"},
    "rainflow": {"response"},
    "fmpy": {"runtime"},
    "FLife": {"response"},
    "pyyeti": {"response"},
    "pyarrow": {"pipeline.study"},
}
ONLY_FROM = {  # finer than packages: what a package may take from another, module by module
    # what files hold, nothing of the solver
    ("formats", "multibody"): {
        *(f"multibody.results.{name}" for name in "result envelopes fields recovered".split()),
        "multibody.analysis.state_space", "multibody.evaluation.system_state",
        "multibody.evaluation.evaluator", "multibody.reference.equations",  # where a system starts, in decks
        *(f"multibody.model.{name}" for name in "constraints joint joint_element loads system time_function".split()),
        "multibody.model.joint_types",
    },
    # the solver sees bodies, their mass at a deflection and a fill level and the motion from which they recover forces;
    # of its own it makes only rigid rods
    ("multibody", "body"): {
        *(f"body.{name}" for name in "deflection exponential flexible_body levels line mass recovery rigid".split()),
        *(f"body.stations.{name}" for name in "error motion record second_order shape".split()),
    },
    # of the model, what the cells of a mesh are, and how matrices of other programs are read
    ("formats", "fe"): {
        "fe.mesh.cells", "fe.mesh.facets", "fe.mesh.mesh", "fe.readers.abaqus.lexer", "fe.readers.abaqus.matrices",
        "fe.readers.entries", "fe.readers.output4", "fe.readers.surface",
        *(f"fe.external.{name}" for name in "archive files model".split()),
    },
    ("report", "fe"): {"fe.mesh.cells", "fe.mesh.facets"},
    ("linalg", ""): {"errors", "lazy"},  # numbers in, numbers out
}  # fmt: skip
KERNELS_TAKE = {
    "modalprep.compiler.jit",
    "modalprep.compiler.by_address",
    "modalprep.compiler.lanes",
    "modalprep.body",
    "modalprep.body.mass",
    "modalprep.multibody.model.joint_types",  # numbers
}  # of mass.py, formulas of numbers


def source(project):
    return project / "src" / "modalprep"


def modules(project):
    """Return the file of every module of the package by its name below ``modalprep``."""
    root = source(project)
    names = {file: ".".join(file.relative_to(root).with_suffix("").parts) for file in sorted(root.rglob("*.py"))}
    return {name.removesuffix(".__init__"): file for file, name in names.items()}


@cache
def imports(file):
    """Return (module, names) for each import of a file."""
    found = []
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            found += [(alias.name, ()) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file} has a relative import"
            found.append((node.module, tuple(alias.name for alias in node.names)))
    return found


def own_imports(file, known):
    """Return the modules of modalprep that a file imports, by their names below ``modalprep``."""
    found = set()
    for module, names in imports(file):
        if module == "modalprep" or module.startswith("modalprep."):
            home = module.removeprefix("modalprep").removeprefix(".")
            inside = {f"{home}.{name}".removeprefix(".") for name in names} & set(known)
            found |= inside or {home}
    return found


@pytest.fixture(scope="module")
def graph(project):
    """Modules of modalprep by the module that imports them."""
    known = modules(project)
    return {name: own_imports(file, known) for name, file in known.items()}


def package(module):
    return module.split(".")[0]


def layer(module):
    """Return the package and the number of a module's layer in it, or None where the package is one layer."""
    home, _, rest = module.partition(".")
    if home not in LAYERS or not rest:
        return None
    folder = rest if rest in LAYERS[home] else rest.rpartition(".")[0]
    assert folder in LAYERS[home], f"{module} is in no layer; name its folder in LAYERS"
    return LAYERS[home].index(folder)


def test_packages_import_downwards(graph):
    for module, imported in graph.items():
        own = package(module)
        for name in imported:
            if own in MAY_IMPORT or own in BASE:  # cli, examples and __init__ see all
                assert package(name) in {own, ""} | MAY_IMPORT.get(own, BASE), f"{module} imports {name}"
                allowed = ONLY_FROM.get((own, package(name)))
                assert allowed is None or name in allowed, f"{module} imports {name}"
            if own == "linalg" and package(name) != "linalg":
                assert name in ONLY_FROM["linalg", ""], f"{module} imports {name}"


def test_folders_import_downwards(graph):
    for module, imported in graph.items():
        for name in imported:
            if package(name) == package(module) and layer(module) is not None and layer(name) is not None:
                assert layer(name) <= layer(module), f"{module} imports {name}, which is in a layer above"


def test_no_circle_of_files(graph):
    inner = {module: imported - {module, ""} for module, imported in graph.items() if module}
    assert len(list(graphlib.TopologicalSorter(inner).static_order())) >= len(inner)


def test_third_parties_have_one_home(project):
    for module, file in modules(project).items():
        for name, _ in imports(file):
            homes = ONLY_IN.get(package(name))
            inside = homes is None or any(module == home or module.startswith(home + ".") for home in homes)
            assert inside, f"{module} imports {name}"


def test_kernels_know_arrays_only(project):
    """Kernels import numpy, the compiler and each other: no record of a user, nothing that packs or steps."""
    found = 0
    for module, file in modules(project).items():
        if module.startswith("multibody.kernels."):
            found += 1
            foreign = {name for name, _ in imports(file)} - KERNELS_TAKE - set(sys.stdlib_module_names)
            foreign = {name for name in foreign if not name.startswith(("modalprep.multibody.kernels", "collections"))}
            assert {package(name) for name in foreign} <= {"numpy"}, module
    assert found > 10


@pytest.mark.parametrize("module", ["multibody.model.system", "multibody.deploying.system", "pipeline.schema.load"])
def test_records_of_users_need_no_compiler(module):
    """Building a system and reading a pipeline file import neither numba nor the solver."""
    code = f"import sys, modalprep.{module}; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert f"modalprep.{module}" in loaded
    solver = [f"modalprep.multibody.{name}" for name in LAYERS["multibody"][2:10]]
    assert not {"numba", "skfem", *solver} & set(loaded)


def test_systems_of_ready_bodies_need_no_meshes():
    """What `modalprep simulate` imports before it finds that a body must be built."""
    code = "import sys, modalprep.pipeline.run, modalprep.pipeline.systems.systems; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "modalprep.multibody.integration.run" in loaded
    meshes = {"skfem", "modalprep.fe.assembly.model", "modalprep.pipeline.building.compute"}
    later = {"matplotlib", "jinja2", "rich.progress", "modalprep.report.pictures"}  # for charts, pages and terminals
    assert not {"scipy.sparse", "scipy.spatial", "scipy.integrate", *later, *meshes} & set(loaded)


def test_charts_come_before_the_artists_of_matplotlib(project):
    """`report.charts` is imported first, as it keeps matplotlib from listing the properties of its artists."""
    for module, file in modules(project).items():
        if not any(name.startswith("matplotlib") for name, _ in imports(file)):
            continue
        for node in ast.parse(file.read_text()).body:  # what is imported only to be annotated does not count
            artists = isinstance(node, ast.ImportFrom) and node.module.startswith(("matplotlib.a", "matplotlib.f"))
            assert not artists or module.startswith("report.charts"), f"{module} imports {node.module}"


def test_commands_leave_out_the_properties_of_artists():
    """Their docstrings and signatures, and the axes in three dimensions."""
    for cli, listed in (("modalprep.cli", 0), ("modalprep", 1)):
        code = (
            f"import sys, {cli}, modalprep.report.analysis; from matplotlib.lines import Line2D; "
            "print(Line2D.set.__doc__, hasattr(Line2D.set, '__signature__'), 'mpl_toolkits.mplot3d' in sys.modules)"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert ("markeredgecolor" in done.stdout) == listed
        assert done.stdout.split()[-2:] == 2 * [str(bool(listed))]
        assert not done.stderr


def test_base_modules_know_only_each_other(graph):
    for module, imported in graph.items():
        if module in BASE:
            assert {package(name) for name in imported} <= BASE | {""}, module  # the package has its version


def test_the_rule_covers_every_package(graph, project):
    packages = {path.parent.name for path in source(project).glob("*/__init__.py")}
    assert packages - {"cli"} == set(MAY_IMPORT)
    assert set(graph) >= BASE


def test_every_exception_of_the_rules_is_used(graph):
    """An entry that nobody needs any more is taken out."""
    used = {(package(module), name) for module, imported in graph.items() for name in imported}
    for (own, target), allowed in ONLY_FROM.items():
        for name in allowed if target else ():
            assert (own, name) in used, f"{own} no longer imports {name}"
    for home, folders in LAYERS.items():
        homes = {module.rpartition(".")[0] for module in graph} | set(graph)
        assert {f"{home}.{folder}" for folder in folders} <= homes


def test_every_folder_is_a_package(project):
    """A folder whose name git ignores, such as build, lacks its first file in a clone and in the wheel."""
    for folder in source(project).rglob("*/"):
        assert (folder / "__init__.py").exists() or not list(folder.glob("*.py")), folder
