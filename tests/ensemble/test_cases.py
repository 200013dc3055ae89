"""Cases: distributions, samplings, explicit values, and the numbers of a system that they change."""

import numpy as np
import pytest
from ensemble_systems import oscillator, pendulums
from scipy.stats import gamma

import modalprep as mp
from modalprep.ensemble.cases import DISTRIBUTIONS, draw_cases, read_cases
from modalprep.ensemble.parameters import Parameters

# Mean and variance of each distribution: closed forms (Johnson, Kotz, Balakrishnan, Continuous Univariate
# Distributions, 2nd ed., Wiley 1994/95, chapters 13, 14 and 26; triangular: Evans, Hastings, Peacock, Statistical
# Distributions, 3rd ed., Wiley 2000, chapter 40).
MOMENTS = {
    "normal": ([2.0, 0.5], 2.0, 0.25),
    "uniform": ([1.0, 4.0], 2.5, 9 / 12),
    "lognormal": ([3.0, 0.2], 3.0 * np.exp(0.02), 9.0 * np.exp(0.04) * (np.exp(0.04) - 1)),
    "triangular": ([0.0, 1.0, 4.0], 5 / 3, (0 + 1 + 16 - 0 - 0 - 4) / 18),
}


def test_moments_cover_every_distribution():
    assert MOMENTS.keys() == DISTRIBUTIONS.keys()


@pytest.mark.parametrize("kind", MOMENTS)
@pytest.mark.parametrize(("sampling", "tolerance"), [("random", 0.05), ("latin_hypercube", 5e-3), ("sobol", 5e-3)])
def test_moments(kind, sampling, tolerance):
    """4096 values: their mean and variance are off by some 1/sqrt(4096) = 1.6 % of the deviation, or far less when
    each of 4096 equally probable intervals has one value."""
    numbers, mean, variance = MOMENTS[kind]
    values = draw_cases({"a.b": {kind: numbers}}, 4096, seed=3, sampling=sampling)["a.b"]
    assert values.mean() == pytest.approx(mean, abs=tolerance * np.sqrt(variance))
    assert values.var() == pytest.approx(variance, rel=2 * tolerance)


def test_latin_hypercube_has_one_value_in_each_interval():
    drawn = draw_cases({"a.b": {"uniform": [0, 1]}, "a.c": {"uniform": [0, 1]}}, 100, sampling="latin_hypercube")
    for values in drawn.values():
        assert np.sort((values * 100).astype(int)).tolist() == list(range(100))
    assert abs(np.corrcoef(*drawn.values())[0, 1]) < 0.5


@pytest.mark.parametrize("sampling", ["random", "latin_hypercube", "sobol"])
def test_seeds_reproduce(sampling):
    law = {"a.b": {"normal": [0, 1]}, "a.c": {"uniform": [0, 1]}}
    one, same, other = (draw_cases(law, 50, seed=seed, sampling=sampling) for seed in (1, 1, 2))
    for name in law:
        assert np.array_equal(one[name], same[name])
        assert not np.array_equal(one[name], other[name])


@pytest.mark.parametrize("sampling", ["random", "sobol"])
def test_more_cases_begin_with_the_fewer(sampling):
    law = {"a.b": {"normal": [0, 1]}, "a.c": {"uniform": [0, 1]}}
    few, many = (draw_cases(law, count, seed=1, sampling=sampling) for count in (16, 40))
    assert all(np.array_equal(few[name], many[name][:16]) for name in law)


def test_distributions_of_scipy():
    assert draw_cases({"a.b": gamma(4.0)}, 2000, sampling="sobol")["a.b"].mean() == pytest.approx(4.0, rel=5e-3)


BAD_DRAWS = {
    "distribution of 'a.b': unknown 'gauss'; known are normal, uniform, lognormal, triangular": {"gauss": [0, 1]},
    "distribution of 'a.b': unknown 'norml'; did you mean 'normal'?": {"norml": [0, 1]},
    "distribution of 'a.b': normal needs 2 numbers: mean, deviation": {"normal": [0, 1, 2]},
    "distribution of 'a.b': uniform needs 2 numbers": {"uniform": ["a", 1]},
    "distribution of 'a.b': normal cannot have mean, deviation = [0.0, -1.0]": {"normal": [0, -1]},
    "distribution of 'a.b': lognormal cannot have median": {"lognormal": [-1, 0.1]},
    "distribution of 'a.b': triangular cannot have lower, mode, upper = [0.0, 3.0, 2.0]": {"triangular": [0, 3, 2]},
    "distribution of 'a.b': 3 is none; give for example": 3,
}


@pytest.mark.parametrize("sentence", BAD_DRAWS)
def test_bad_distributions(sentence):
    with pytest.raises(mp.InputError) as caught:
        draw_cases({"a.b": BAD_DRAWS[sentence]}, 4)
    assert str(caught.value).startswith(sentence)


def test_bad_draws():
    law = {"a.b": {"normal": [0, 1]}}
    with pytest.raises(mp.InputError, match="the number of cases is 0; give a whole number from 1"):
        draw_cases(law, 0)
    with pytest.raises(mp.InputError, match="sampling 'sobel' does not exist; did you mean 'sobol'"):
        draw_cases(law, 4, sampling="sobel")
    with pytest.raises(mp.InputError, match="give a distribution for each parameter"):
        draw_cases({}, 4)


BAD_CASES = {
    "there are no cases": {},
    "there are no cases; give": {"a.b": []},
    "cases: 'a.b' has 2 values and 'a.c' 3; give as many of each": {"a.b": [1, 2], "a.c": [1, 2, 3]},
    "cases: 'a.b' is not a finite number in case 1": {"a.b": [1, np.nan]},
    "cases: the values of 'a.b' are not numbers": {"a.b": ["x"]},
    "cases: 'a.b' needs a list of values": {"a.b": 1.0},
    "cases: 'a.c' is not in all cases, see case 1": [{"a.b": 1, "a.c": 2}, {"a.b": 1}],
    "cases must be a mapping": "a.b",
}


@pytest.mark.parametrize("sentence", BAD_CASES)
def test_bad_cases(sentence):
    with pytest.raises(mp.InputError) as caught:
        read_cases(BAD_CASES[sentence])
    assert str(caught.value).startswith(sentence)


BAD_NAMES = {
    "shoulder.angel": "parameter 'shoulder.angel': did you mean 'angle'? 'shoulder' has ",
    "sholder.angle": "parameter 'sholder.angle' names no joint, load or closure; did you mean 'shoulder'?",
    "shoulder.angle.x": "parameter 'shoulder.angle.x': angle of 'shoulder' is one number; leave out 'x'",
    "shoulder.displacement": "parameter 'shoulder.displacement': ",
    "gravity.w": "parameter 'gravity.w': 'gravity' has 3 numbers; name one of them by .x, .y, .z",
    "push.force": "parameter 'push.force': 'push.force' has 3 numbers; name one of them by .x, .y, .z",
    "stay.between": "parameter 'stay.between': ",
    "gravity": "parameter 'gravity': 'gravity' has 3 numbers; name one of them by .x, .y, .z",
}


@pytest.mark.parametrize("name", BAD_NAMES)
def test_unknown_parameters(name):
    with pytest.raises(mp.InputError) as caught:
        Parameters(pendulums(), [name])
    assert str(caught.value).startswith(BAD_NAMES[name])


def test_numbers_of_joints_and_loads():
    names = ["shoulder.angle", "elbow.rate", "elbow.damping", "stay.stiffness", "stay.free_length", "push.force.x",
             "push.torque.z", "gravity.y", "shoulder.position.2"]  # fmt: skip
    given = [0.1, 0.2, 0.3, 4.0, 5.0, 6.0, 7.0, -8.0, 9.0]
    system = Parameters(pendulums(), names).change(given)
    (shoulder, elbow), (stay, push) = system.joints, system.loads
    found = [shoulder.angle, elbow.rate, elbow.elements[0].damping, stay.stiffness, stay.free_length]
    found += [push.force[0](1.0)[0], push.torque[2](1.0)[0], system.gravity[1], shoulder.position[1]]
    assert found == given
    assert system.gravity[0] == 0.0


def test_several_coordinates_of_a_joint():
    body = oscillator().bodies["block"]
    planar = mp.Joint(name="table", type="planar", parent="ground", child="block", displacement=np.array([1.0, 2.0]))
    system = mp.System(bodies={"block": body}, joints=(planar,))
    found = Parameters(system, ["table.displacement.2", "table.stiffness.1", "table.stiffness.3", "table.angle"])
    (joint,) = found.change([5.0, 10.0, 30.0, 0.4]).joints
    assert joint.displacement.tolist() == [1.0, 5.0]
    assert [element.stiffness for element in joint.elements] == [10.0, 0.0, 30.0]
    assert joint.angle == 0.4


def test_amplitude_multiplies_functions_of_time():
    system = pendulums()
    motor = mp.multibody.HingeElement(drive=mp.multibody.TimeFunction.table([0, 1, 2], [0, 1, 3]))
    joints = (system.joints[0].with_(elements=motor), system.joints[1])
    changed = Parameters(system.with_(joints=joints), ["push.amplitude", "shoulder.amplitude"]).change([3.0, -2.0])
    for t in (0.2, 1.5):
        assert np.allclose(changed.loads[1].force[0](t), 3 * np.array(system.loads[1].force[0](t)), rtol=1e-14)
        assert np.allclose(
            changed.joints[0].elements[0].drive(t), -2 * np.array(motor.drive(t)), rtol=1e-14, atol=1e-14
        )
    with pytest.raises(mp.InputError, match="'elbow' has "):  # no function of time
        Parameters(system, ["elbow.amplitude"])


def test_rotation_turns_a_joint_in_the_axes_of_its_parent():
    quarter = np.array([[0, -1.0, 0], [1, 0, 0], [0, 0, 1]])
    free = mp.Joint(name="free", type="free", parent="ground", child="block", rotation=quarter)
    system = mp.System(bodies={"block": oscillator().bodies["block"]}, joints=(free,))
    turned = Parameters(system, ["free.rotation.x"]).change([np.pi / 2]).joints[0].rotation
    assert np.allclose(turned, np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]) @ quarter, atol=1e-15)


def test_names_with_dots_and_twice():
    system = pendulums()
    stay = system.loads[0]
    dotted = Parameters(system.with_(loads=(stay.with_(name="a.b"), stay.with_(name="a"))), ["a.b.stiffness"])
    assert dotted.change([7.0]).loads[0].stiffness == 7.0
    with pytest.raises(mp.InputError, match="names several records of 'elbow'"):
        Parameters(system.with_(loads=(stay.with_(name="elbow"),)), ["elbow.stiffness"])
