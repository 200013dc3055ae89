"""A small part of every family of elements, with responses, and values for the keys of its tables that show."""

import copy
from dataclasses import fields, is_dataclass

import numpy as np
from bad.keys import Family

from modalprep.pipeline.building.compute import compute_body
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.responses.respond import computed, refuse_responses
from modalprep.pipeline.responses.strength import strength
from modalprep.pipeline.schema import fe, properties, reduction
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.schema.responses import response
from modalprep.pipeline.schema.responses import strength as of_strength

MESH = """*NODE
1, 0, 0, 0
2, .5, .05, .1
3, 1, .1, .2
4, 1.4, .1, .25
5, 1.4, .5, .3
6, 1, .5, .2
7, 1.45, .9, .3
8, 1, .9, .25
9, 1.8, .3, .3
12, 1, .5, .5
13, 1.4, .5, .6
14, 1.45, .9, .6
15, 1, .9, .55
*ELEMENT, TYPE=B31, ELSET=spar
1, 1, 2
2, 2, 3
*ELEMENT, TYPE=S4, ELSET=skin
3, 3, 4, 5, 6
4, 6, 5, 7, 8
*ELEMENT, TYPE=S3, ELSET=skin
5, 4, 9, 5
*ELEMENT, TYPE=C3D8, ELSET=core
6, 6, 5, 7, 8, 12, 13, 14, 15
*ELEMENT, TYPE=T3D2, ELSET=stay
7, 3, 12
*ELEMENT, TYPE=T3D2, ELSET=link
8, 2, 6
*ELEMENT, TYPE=MASS, ELSET=ball
9, 9
*NSET, NSET=edge
6, 8, 12, 15
"""
MATERIAL = {"alloy": {"E": 7e10, "nu": 0.3, "rho": 2700.0}}
PLY = {"type": "orthotropic", "E1": 5e10, "E2": 1e10, "nu12": 0.3, "G12": 4e9, "G13": 4e9, "G23": 3e9, "rho": 1600.0}
TIMBER = {"type": "orthotropic_solid", "E1": 5e10, "E2": 1e10, "E3": 2e10, "nu12": 0.3, "nu13": 0.2, "nu23": 0.25,
          "G12": 4e9, "G13": 5e9, "G23": 3e9, "rho": 800.0}  # fmt: skip
OF = {"material": "alloy"}
SPAR = {"type": "beam", "A": 4e-4, "Iy": 8e-7, "Iz": 2e-7, "J": 5e-7, **OF}
SHAPED = {"type": "beam", "section": {"shape": "box", "width": 0.05, "height": 0.03, "thickness": 0.002}, **OF}
SECTIONS = {
    "spar": SPAR,
    "skin": {"type": "shell", "thickness": 0.01, **OF},
    "core": {"type": "solid", **OF},
    "stay": {"type": "truss", "A": 1e-4, **OF},
    "link": {"type": "spring", "translation": [1e5, 2e5, 3e5], "rotation": [1e3, 2e3, 3e3]},
    "ball": {"type": "mass", "mass": 2.0},
}
MODAL = ("craig_bampton", "free_interface")
REDUCTION = {"modes": 3, "second_order_mass": False}


def base():
    """A part that a spar holds."""
    return copy.deepcopy({
        "mesh": {"file": "part.inp"},
        "materials": MATERIAL | {"ply": PLY, "timber": TIMBER},
        "properties": SECTIONS,
        "interfaces": {"root": {"node": 1}, "tip": {"node": 9, "boundary": "free"}},
        "reduction": REDUCTION,
        "output": {"pictures": "none"},
    })  # fmt: skip


class PartFamily(Family):
    """A table of a pipeline file that makes a part."""

    def __init__(self, table, place, variants, values, around=None):
        super().__init__(table, place, variants, values, around, start=base)

    def result(self, path):
        """Return all that comes of a file: its body, responses, spectra, damage and notes, by names."""
        (path.parent / "part.inp").write_text(MESH)
        source = load(path)
        if source.pipeline.response:
            refuse_responses(source)
        built = compute_body(source, path.with_suffix(".h5"), quiet := Reporter(quiet=True), None)
        tables = source.pipeline.response
        found = {name: computed(table, built.body, path.parent)[0] for name, table in tables.items()}
        done = strength(source, found, path.parent, quiet)
        body = {name: value for name, value in vars(built.body).items() if name != "provenance"}
        notes = " ".join([*built.notes, *(note for each in found.values() for note in each.notes), *done.notes])
        return dict(_leaves({"body": body, "error": built.error, "tables": built.tables, "response": found,
                             "srs": done.shocks, "fatigue": done.fatigue, "notes": notes}))  # fmt: skip

    def same(self, one, other):
        """Whether two parts are equal beyond round-off."""
        return one.keys() == other.keys() and all(_equal(one[key], other[key]) for key in one)

    def notes(self, result):
        """Return what was noted."""
        return result[".notes"]


def _leaves(value, name=""):
    """Yield names and arrays or words of all that a value holds."""
    if is_dataclass(value):
        value = {field.name: getattr(value, field.name) for field in fields(value)}
    elif isinstance(value, tuple | list) and not all(isinstance(each, float | int) for each in value):
        value = dict(enumerate(value))
    if isinstance(value, dict):
        for key, inside in value.items():
            yield from _leaves(inside, f"{name}.{key}")
    else:
        yield name, value


def _equal(a, b):
    a, b = np.asarray(a), np.asarray(b)
    if a.shape != b.shape or a.dtype.kind not in "fciub":
        return a.shape == b.shape and bool(np.all(a == b))
    size = np.abs(a[np.isfinite(a)]).max(initial=0.0)
    return np.allclose(a, b, rtol=1e-7, atol=1e-7 * size, equal_nan=True)


def sections(name, table, variants, values):
    """Return the family of the property of one group."""
    return PartFamily(table, ("properties", name), variants, values)


LEVELS = {"frequency": [20.0, 500.0], "values": [1e-3, 2e-3]}
DRIVE = {"x": 2.0}
HARMONIC = {"kind": "harmonic", "base": DRIVE}
RANDOM = {"kind": "random", "damping": 0.02, "base": {"x": LEVELS}}
HISTORY = {"t": [0.0, 0.01, 0.02], "values": [5.0, 10.0, 0.0]}
TRANSIENT = {"kind": "transient", "base": {"x": HISTORY}}
NOTCH = {"channel": "base.force.x"}
DAMAGE = {"channels": ["base.force.x"], "cycles": 1e3, "slope": 3.0}

FAMILIES = {
    "beam": sections(
        "spar", properties.BeamTable, {"numbers": SPAR, "shape": SHAPED},
        {"ky": [0.4], "kz": [0.4], "up": [[0.0, 1.0, 0.3]], "offset": [[0.01, 0.02]], "nsm": [2.0],
         "theory": ["euler-bernoulli"], "shear_centre": [[0.01, 0.02]],
         "taper": [[[0, 4e-4, 8e-7, 2e-7, 5e-7, 0], [1, 2e-4, 4e-7, 1e-7, 3e-7, 1]]]},
    ),
    "truss": sections("stay", properties.TrussTable, {"bar": SECTIONS["stay"]}, {"J": [1e-7], "nsm": [2.0]}),
    "shell": sections(
        "skin", properties.ShellTable,
        {"sheet": SECTIONS["skin"], "laminate": {"type": "shell", "plies": [
            {"material": "ply", "thickness": 0.004, "angle": 0.3}, {"material": "ply", "thickness": 0.006}]}},
        {"material": ["ply"], "thickness": [0.02], "symmetric": [True], "offset": [0.01], "nsm": [3.0],
         "axis": [[0.3, 1.0, 0.0]], "angle": [0.5], "membrane": ["cst"]},
    ),
    "solid": sections("core", properties.SolidTable, {"metal": SECTIONS["core"], "timber": {"type": "solid",
                      "material": "timber"}}, {"axes": [[[0.0, 1, 0], [1.0, 1, 0]]]}),
    "mass": sections(
        "ball", properties.MassTable, {"mass": SECTIONS["ball"], "none": {"type": "mass", "mass": 0.0}},
        {"inertia": [[0.1, 0.2, 0.2, 0.01, 0.0, 0.02]], "offset": [[0.1, 0.0, 0.05]]},
    ),
    "spring": sections(
        "link", properties.SpringTable,
        {"both": SECTIONS["link"], "along": {"type": "spring", "translation": [1e5, 1e5, 1e5]},
         "about": {"type": "spring", "rotation": [1e3, 2e3, 3e3]}},
        {"translation": [[3e5, 2e5, 1e5]], "rotation": [[3e3, 2e3, 1e3]], "up": [[0.0, 1.0, 0.0]], "location": [0.2]},
    ),
    "mesh": PartFamily(
        fe.MeshTable, ("mesh",), {"inp": {"file": "part.inp"}},
        {"length_unit": ["mm"], "mass_unit": ["t"], "ignore": [["*TIE"], ["*NSET"]], "size": [0.1], "order": [1],
         "mass": ["lumped"]},
    ),
    "load": PartFamily(
        reduction.LoadTable, ("loads", "l"),
        {"force": {"group": "edge", "force": [1.0, 2.0, 3.0]}, "moment": {"node": 5, "moment": [1.0, 2.0, 3.0]},
         "pressure": {"group": "skin", "pressure": 1.0}, "traction": {"group": "skin", "traction": [0.0, 1.0, 3.0]},
         "line": {"group": "spar", "line_load": [1.0, 0.0, 3.0]}},
        {"force": [[3.0, 1.0, 1.0]], "moment": [[1.0, 0.0, 0.0]], "pressure": [1.0], "position": [[0.3, 0.4, 0.5]],
         "traction": [[1.0, 0.0, 0.0]], "line_load": [[0.0, 1.0, 0.0]]},
        {"reduction": REDUCTION | {"truncation_vectors": ["l"]}},
    ),
    "foundation": PartFamily(
        fe.FoundationTable, ("foundations", "bed"),
        {"area": {"group": "skin", "stiffness_per_area": 1e6},
         "length": {"group": "spar", "stiffness_per_length": 1e6}},
        {"stiffness_per_area": [[1e6, 0.0, 2e6]], "stiffness_per_length": [[1e6, 0.0, 2e6]]},
    ),
    "added_mass": PartFamily(
        fe.AddedMassTable, ("added_masses", "coat"),
        {"area": {"group": "skin", "mass_per_area": 3.0}, "length": {"group": "spar", "mass_per_length": 3.0},
         "fluid": {"group": "skin", "fluid_density": 900.0, "depth": 0.1}},
        {"mass_per_area": [5.0], "mass_per_length": [5.0], "fluid_density": [800.0], "depth": [0.2]},
    ),
    "interface": PartFamily(
        fe.InterfaceTable, ("interfaces", "tip"),
        {"node": {"node": 9}, "group": {"group": "edge"}, "rbe3": {"group": "edge", "kind": "rbe3"}},
        {"kind": ["rbe2", "rbe3"], "boundary": ["free"], "position": [[1.0, 0.7, 0.4]]},
    ),
    "reduction": PartFamily(
        reduction.ReductionTable, ("reduction",), {kind: REDUCTION | {"method": kind} if kind in MODAL else
        {"method": kind, "second_order_mass": False} for kind in ("craig_bampton", "guyan", "irs", "free_interface")},
        {"modes": [5], "keep": [[1, 2]], "up_to": [500.0], "target_error": [0.1],
         "truncation_vectors": [["inertia"], []],
         "second_order_mass": [True], "damping": [0.03], "root": ["tip"]},
        {"interfaces": {"tip": {"node": 9}, "edge": {"group": "edge", "kind": "rbe3", "boundary": "free"}}},
    ),
    "recovery": PartFamily(
        fe.RecoveryTable, ("recovery", "x"),
        {"section_force": {"kind": "section_force", "group": "spar"}, "force": {"kind": "force", "group": "link"},
         "resultant": {"kind": "resultant", "group": "skin"}, "stress": {"kind": "stress", "group": "core"},
         "reaction": {"kind": "reaction"}, "cut": {"kind": "cut", "group": "skin"},
         "acceleration": {"kind": "acceleration", "node": 5}, "displacement": {"kind": "displacement", "node": 5}},
        {"method": ["displacement"], "stations": [4], "axis": [[0.0, 1.0, 0.2]], "allowable": [1e3]},
    ),
    "stress": PartFamily(
        fe.StressTable, ("stress", "x"),
        {"beam": {"node": 2, "element_group": "spar", "fibres": [[0.02, 0.01]]},
         "shell": {"node": 3, "element_group": "skin"}, "solid": {"node": 14}},
        {"element_group": ["skin"], "direction": [[0.0, 0.0, 1.0]], "axis": [[0.0, 1.0, 0.2]],
         "fibres": [[[0.01, 0.02]]]},
    ),
    "connection": PartFamily(
        fe.ConnectionTable, ("connections", "bolt"), {"ends": {"group": "edge"}},
        {"kind": ["rbe2"], "position": [[1.0, 0.7, 0.4]]}, {"properties": {"bolt": SECTIONS["ball"]}},
    ),
    "harmonic": PartFamily(
        response.HarmonicTable, ("response", "x"),
        {"band": HARMONIC | {"lowest": 10.0, "highest": 200.0}, "list": HARMONIC | {"frequency": [10.0, 20.0, 30.0]}},
        {"points": [30], "spacing": ["linear"], "refine": [False], "damping": [0.05], "channels": [["base.force.x"]],
         "forces": [{"tip": {"z": 3.0}}], "notch": [[NOTCH | {"limit": 10.0}]]},
    ),
    "sweep": PartFamily(
        response.SweepTable, ("response", "x"), {"up": {"kind": "sweep", "base": DRIVE, "lowest": 10.0, "highest": 12.0,
                                                       "rate": "30 oct/min"}},
        {"direction": ["down"], "samples": [40], "damping": [0.05], "channels": [["base.force.x"]],
         "forces": [{"tip": {"z": 3.0}}]},
    ),
    "random": PartFamily(
        response.RandomTable, ("response", "x"),
        {"one": RANDOM, "two": RANDOM | {"forces": {"tip": {"z": LEVELS}}}},
        {"correlation": ["full"], "coherence": [[{"between": ["base.x", "forces.tip.z"], "coherence": 0.5}],
                                                [{"between": ["base.x", "tip.z"], "coherence": 0.5}]],
         "damping": [0.05], "channels": [["base.force.x"]], "notch": [[NOTCH | {"limit": 1.0}]]},
    ),
    "transient": PartFamily(
        response.TransientTable, ("response", "x"), {"base": TRANSIENT},
        {"step": [1e-4], "duration": [0.05], "damping": [0.05], "channels": [["base.force.x"]],
         "forces": [{"tip": {"z": HISTORY}}]},
    ),
    "notch": PartFamily(
        of_strength.NotchTable, ("response", "x", "notch"),
        {"limit": NOTCH | {"limit": 10.0}, "factor": NOTCH | {"factor": 1.0, "break_frequency": 20.0},
         "design": NOTCH | {"design_acceleration": 1.0}},
        {"rolloff": [2.0], "mass": [3.0]}, {"response": {"x": HARMONIC | {"lowest": 10.0, "highest": 200.0}}},
    ),
    "srs": PartFamily(
        of_strength.ShockTable, ("srs", "y"),
        {"of x": {"response": "x", "channels": ["base.force.x"], "lowest": 10.0, "highest": 100.0}},
        {"points": [20], "Q": [20.0], "kind": ["relative_displacement"], "start": ["steady"]},
        {"response": {"x": TRANSIENT}},
    ),
    "fatigue": PartFamily(
        of_strength.FatigueTable, ("fatigue", "y"),
        {"transient": DAMAGE | {"response": "x", "stress": 50.0}, "random": DAMAGE | {"response": "z", "stress": 50.0,
         "duration": 10.0}},
        {"scale": [2.0], "second_slope": [5.0], "knee": [1e5], "limit": [100.0], "ultimate": [1e3], "repeats": [3.0],
         "duration": [20.0], "method": ["narrow_band", "steinberg"]},
        {"response": {"x": TRANSIENT, "z": RANDOM}},
    ),
}  # fmt: skip
