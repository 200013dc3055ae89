"""Who may import whom: the flow mesh, model, reduction, body, system, result; nothing points backwards."""

import ast
import sys

BASE = {"errors", "records", "suggest", "atomic", "vectors", "jit"}
MAY_IMPORT = {
    "linalg": BASE,
    "fe": BASE | {"linalg"},
    "reduction": BASE | {"linalg", "fe"},
    "body": BASE | {"linalg", "fe", "reduction"},
    "multibody": BASE | {"body"},
    "formats": BASE | {"linalg", "body", "reduction", "multibody"},
    "report": BASE | {"body", "reduction", "multibody", "formats"},
    "pipeline": BASE | {"body", "fe", "formats", "linalg", "multibody", "reduction", "report"},
}
ONLY_IN = {  # third parties with one home
    "skfem": {"fe"},
    "meshio": {"fe", "report"},
    "gmsh": {"fe"},
    "numba": {"jit", "multibody"},
    "pyvista": {"report"},
    "matplotlib": {"report"},
    "pydantic": {"pipeline"},
    "symengine": {"multibody"},
    "h5py": {"formats"},
}
KERNEL = {"multibody.kernel", "jit"}  # arrays only


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
    allowed = {"collections.abc", "numpy", "numba"} | sys.stdlib_module_names
    for module, imported in modules(project):
        if module in KERNEL:
            own = {"modalprep.jit", *(f"modalprep.multibody.{name}" for name in ("algebra", "flexible", "layout"))}
            assert set(imported) <= allowed | own, module


def test_the_rule_covers_every_package(project):
    packages = {p.parent.name for p in (project / "src" / "modalprep").glob("*/__init__.py")}
    assert packages - {"cli"} == set(MAY_IMPORT)


# Finer than packages: what a package may take from another, module by module.
ONLY_FROM = {
    ("formats", "multibody"): {"multibody.result", "multibody.state_space"},  # what files hold, nothing of the solver
    # the solver sees bodies and their mass at a deflection and a fill level; of its own it makes only rigid rods
    ("multibody", "body"): {"body", "body.flexible_body", "body.levels", "body.mass", "body.rigid"},
    ("linalg", ""): {"errors"},  # numbers in, numbers out
}
NEVER = {("multibody", "fe"), ("multibody", "reduction"), ("multibody", "linalg")}
# arrays: numpy and numba
ALONE = {"multibody.kernel", "multibody.flexible", "multibody.algebra", "multibody.layout", "jit"}


def own_imports(file):
    """Yield the modules of modalprep a file imports, also as ``from modalprep import x``."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            yield from (a.name.removeprefix("modalprep.") for a in node.names if a.name.startswith("modalprep."))
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file} has a relative import"
            if node.module == "modalprep":
                yield from (alias.name for alias in node.names)
            elif node.module.startswith("modalprep."):
                yield node.module.removeprefix("modalprep.")


def own_modules(project):
    source = project / "src" / "modalprep"
    for file in sorted(source.rglob("*.py")):
        module = ".".join(file.relative_to(source).with_suffix("").parts).removesuffix(".__init__")
        yield module, module.split(".")[0], set(own_imports(file))


def test_packages_take_only_what_they_need(project):
    for module, package, imported in own_modules(project):
        for name in imported:
            target = name.split(".")[0]
            assert (package, target) not in NEVER, f"{module} imports {name}"
            allowed = ONLY_FROM.get((package, target))
            assert allowed is None or name in allowed, f"{module} imports {name}"
            if package == "linalg" and target != "linalg":
                assert name in ONLY_FROM["linalg", ""], f"{module} imports {name}"


def test_nothing_imports_what_stands_above(project):
    """Command line, examples and pipelines are for users: no other package needs them."""
    for module, package, imported in own_modules(project):
        if package in MAY_IMPORT or package in BASE:
            above = {"cli", "examples"} | ({"pipeline"} if package != "pipeline" else set())
            assert not {name.split(".")[0] for name in imported} & above, module


def test_base_modules_know_only_each_other(project):
    for module, package, imported in own_modules(project):
        if package in BASE:
            assert {name.split(".")[0] for name in imported} <= BASE, module


def test_kernels_import_numpy_numba_and_their_own_package(project):
    plain = {"collections.abc", "numpy", "numba"} | sys.stdlib_module_names
    for module, imported in modules(project):
        if module in ALONE:
            foreign = {n for n in imported if not n.startswith("modalprep.multibody")} - plain
            body = {"modalprep.body", "modalprep.body.flexible_body", "modalprep.body.mass"}  # layout packs its arrays
            assert foreign <= body | {"modalprep.jit"}, module


def test_every_exception_of_the_rules_is_used(project):
    """An entry that nobody needs any more is taken out."""
    used = {(package, name) for _, package, imported in own_modules(project) for name in imported}
    for (package, target), allowed in ONLY_FROM.items():
        for name in allowed if target else ():
            assert (package, name) in used, f"{package} no longer imports {name}"
    assert {module for module, _, _ in own_modules(project)} >= KERNEL | ALONE
