"""Who may import whom: the flow mesh, model, reduction, body, system, result; nothing points backwards."""

import ast

BASE = {"errors", "records", "suggest", "atomic", "vectors"}
MAY_IMPORT = {
    "linalg": BASE,
    "fe": BASE | {"linalg"},
    "reduction": BASE | {"linalg", "fe"},
    "body": BASE | {"linalg", "fe", "reduction"},
    "multibody": BASE | {"body"},
    "formats": BASE | {"body", "reduction", "multibody"},
    "report": BASE | {"body", "reduction", "multibody", "formats"},
    "pipeline": BASE | {"body", "fe", "formats", "linalg", "multibody", "reduction", "report"},
}
ONLY_IN = {  # third parties with one home
    "skfem": {"fe"},
    "meshio": {"fe", "report"},
    "gmsh": {"fe"},
    "numba": {"multibody"},
    "pyvista": {"report"},
    "matplotlib": {"report"},
    "pydantic": {"pipeline"},
    "symengine": {"multibody"},
    "h5py": {"formats"},
}
KERNEL = {"multibody.kernel", "multibody.jit"}  # arrays only


def imports(file):
    """Yield (module, whether at run time) for each import of a file."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module


def modules(project):
    source = project / "src" / "modalprep"
    for file in sorted(source.rglob("*.py")):
        yield ".".join(file.relative_to(source).with_suffix("").parts), list(imports(file))


def test_nothing_points_backwards(project):
    for module, imported in modules(project):
        package = module.split(".")[0]
        if package not in MAY_IMPORT and package not in BASE:
            continue  # cli, examples and __init__ see all
        for name in imported:
            home, _, rest = name.partition(".")
            target = rest.split(".")[0]
            if home == "modalprep" and target:
                assert target == package or target in MAY_IMPORT.get(package, BASE), f"{module} imports {name}"


def test_third_parties_have_one_home(project):
    for module, imported in modules(project):
        for name in imported:
            homes = ONLY_IN.get(name.split(".")[0])
            assert homes is None or module.split(".")[0] in homes, f"{module} imports {name}"


def test_kernels_know_arrays_only(project):
    allowed = {"__future__", "typing", "collections.abc", "numpy", "numba"}
    for module, imported in modules(project):
        if module in KERNEL:
            own = {"modalprep.multibody.jit", "modalprep.multibody.layout"}
            assert set(imported) <= allowed | own, module


def test_the_rule_covers_every_package(project):
    packages = {p.parent.name for p in (project / "src" / "modalprep").glob("*/__init__.py")}
    assert packages == set(MAY_IMPORT)
