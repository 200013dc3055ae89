"""Every key that is accepted changes a result or is noted; every other one is refused with a sentence.

`MODALPREP_FULL=10` tries ten times as many random pairs of keys, and others each time.
"""

import random
import re

import pytest
import tomli_w
from bad import keys, parts
from bad.keys import WIRE, base, system
from size import FULL, cases, some

import modalprep as mp
from modalprep.multibody import Closure, HingeElement
from modalprep.multibody.model.environment import Orbit
from modalprep.multibody.model.hydrodynamics import Water
from modalprep.pipeline.schema.base import Table

FAMILIES = keys.FAMILIES | parts.FAMILIES
IDLE = {  # keys that say what holds anyway in these systems
    ("stress", "element_group"): "elements of one group meet at these nodes",
    ("stress", "direction"): "the elements that meet there have about one direction",
    ("joint", "keep_start"): "there is no loop whose closing moves the joint",
    ("event", "once"): "the closure that the event releases is not closed again",
}
PAIRS = 300


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("keys")


def written(folder, file):
    """Write a pipeline file."""
    path = folder / "job.toml"
    path.write_text(tomli_w.dumps(file))
    return path


def run(folder, family, variant, given):
    """Return the result of a pipeline file, or the sentence that refuses it."""
    try:
        return family.result(written(folder, family.file(variant, given)))
    except mp.ModalprepError as error:
        return str(error)


def shows(folder, family, variant, given, key):
    """Whether a key is refused beside others, changes the result or is noted."""
    before = run(folder, family, variant, given)
    for value in family.values[key]:
        after = run(folder, family, variant, given | {key: value})
        if not isinstance(after, str):
            return isinstance(before, str) or not family.same(before, after) or "no effect" in family.notes(after)
    return True


def names():
    return [(name, variant, key) for name, family in FAMILIES.items() for variant in family.variants
            for key, values in family.values.items() if (name, key) not in IDLE
            and family.variants[variant].get(key) not in values]  # fmt: skip


@pytest.mark.parametrize(("name", "variant", "key"), some(names(), 30))
def test_a_key_shows_or_is_refused(folder, name, variant, key):
    assert shows(folder, FAMILIES[name], variant, {}, key)


def random_pairs():
    """Pairs of keys of one variant, of which the first is accepted alone."""
    rng, several = random.Random(None if FULL > 1 else 6), [row for row in names() if len(FAMILIES[row[0]].values) > 1]
    for _ in range(cases(PAIRS) if FULL else 15):
        name, variant, key = rng.choice(several)
        yield name, variant, rng.choice([other for other in FAMILIES[name].values if other != key]), key


@pytest.mark.parametrize(("name", "variant", "first", "key"), list(random_pairs()))
def test_a_key_shows_or_is_refused_beside_another(folder, name, variant, first, key):
    family = FAMILIES[name]
    tried = [{first: value} for value in family.values[first]]
    alone = [given for given in tried if not isinstance(run(folder, family, variant, given), str)]
    assert not alone or shows(folder, family, variant, alone[0], key)


def every_table(kind=Table):
    """Return the classes of all tables of pipeline files."""
    return [found for own in kind.__subclasses__() for found in (own, *every_table(own))]


RECORDS = [mp.Joint, HingeElement, Closure, Orbit, Water, mp.Event]


@pytest.mark.parametrize("kind", [k for k in [*every_table(), *RECORDS] if k.applies], ids=lambda k: k.__name__)
def test_rules_name_keys(kind):
    fields = getattr(kind, "model_fields", None) or kind.__dataclass_fields__
    for rule in kind.applies:
        for key in (*rule.keys, *rule.needs, *rule.beside):
            assert key.split(".")[0] in fields


REFUSED = [  # changes of the file of `base`, and words of the sentence
    ({"joints.r": {"type": "planar", "start": {"velocity": [1, 0, 0]}}},
     "planar joint has no velocity; it starts with angle, rate, displacement, speed"),
    ({"joints.r": {"motion": "t", "start": {"angle": 1.0}}}, "'angle' has no effect beside 'motion'"),
    ({"joints.r": {"second_axis": [0, 1, 0]}}, "'second_axis' has no effect where type = 'revolute'"),
    ({"joints.r": {"limits": {"stiffness": 1e5}}}, "'stiffness' has no effect without 'lower' or 'upper'"),
    ({"joints.q": {"position": [1, 0, 0]}}, "'position' has no effect where parent = 'a.tip' and type = 'universal'"),
    ({"forces.f": {"at": "b.tip", "force": [0, 1, 0], "factor": 0.0}}, "'factor' has no effect beside 'at'"),
    ({"forces.f": {"at": "b.tip", "force": [0, 1, 0], "box": [[0, 0, 0], [1, 1, 1]]}}, "'box' has no effect"),
    ({"forces.f": {"body": "b", "force": [0, 1.0, 0], "torque": [0, 0, 1.0]}}, "'torque' has no effect beside 'body'"),
    ({"bushings.x": {"between": ["ground", "b.tip"], "damping": [30.0] * 6, "position": [1.0, 0, 0]}},
     "'position' has no effect without 'stiffness'"),
    ({"film": {"follow": "nobody"}}, "follow: body 'nobody' does not exist"),
    ({"simulation": {"variables": "momentum", "atol": 1e-6}}, "'atol' has no effect where variables = 'momentum'"),
    ({"simulation": {"theory": "no_geometric_stiffness", "compare_conventional": True}}, "'compare_conventional'"),
    ({"environment": {"water": {}, "gravity": [0, 0, 1.0]}}, None),
    ({"environment": {"water": {"density": 900.0}}}, "'environment.water' has no effect without 'immersed'"),
    ({"materials": {"steel": {"E": 2e11, "nu": 0.3, "rho": 7800.0}}}, "'materials' has no effect without 'mesh'"),
    ({"output": {"export": ["sid"]}}, "'output.export' has no effect"),
    ({"environment": {"orbit": {"altitude": 4e5, "dipole": {"strength": 3e-5, "longitude": 0.5}}}, **WIRE},
     "'longitude' has no effect without 'tilt'"),
    ({"environment": {"orbit": {"altitude": 4e5, "dipole": {"strength": 3e-5}, "argument_of_latitude": 0.7}}, **WIRE},
     "'argument_of_latitude' has no effect without 'inclination' or 'dipole.tilt'"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "said"), REFUSED, ids=[str(row[0])[:70] for row in REFUSED])
def test_keys_without_effect(folder, changes, said):
    from modalprep.pipeline.systems.outline import refuse_channels

    file = base()
    for place, given in changes.items():
        first, _, rest = place.partition(".")
        inside = file.setdefault(first, {})
        (inside.setdefault(rest, {}) if rest else inside).update(given)
    with pytest.raises(mp.InputError, match=re.escape(said or "'environment.water' has no effect")):
        refuse_channels(*system(written(folder, file)))


@pytest.mark.parametrize(("change", "noted"), [("deactivates", True), ("activates", False)])
def test_a_closure_that_is_never_active_is_noted(folder, change, noted):
    file = base() | {"closures": {"x": {"type": "spherical", "a": "a.tip", "b": "c.root", "active": False}}}
    path = written(folder, file | {"events": {"e": {"when": "t - 1", change: ["x"]}}})
    found = FAMILIES["joint"].result(path).notes
    assert ("'x' has no effect: it is inactive, and no event activates it" in found) == noted
