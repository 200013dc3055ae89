"""The command that looks at the installation."""

import json

import pytest

from modalprep.cli import installation as doctor
from modalprep.cli import main


def test_it_says_what_is_installed_and_that_it_computes(capsys):
    """The error of the beam is that of shear, which the closed form leaves out; the swing is one to 1e-8."""
    assert main(["doctor", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["verdict"] == "PASS"
    assert found["installation"]["factorisation"].startswith(("PARDISO", "SuperLU"))
    assert found["extras"]["build"] is True


def test_wrong_numbers_end_with_exit_code_1(capsys, monkeypatch):
    monkeypatch.setattr(doctor, "_swing", lambda: 0.1)
    assert main(["doctor"]) == 1
    out, error = capsys.readouterr()
    assert "FAILED: a swing: off its closed form by 1.0e-01 of at most 1e-06" in out
    assert "this installation computes wrong numbers" in error


@pytest.mark.parametrize(("missing", "says"), [("pypardiso", "SuperLU; faster factorisation needs pypardiso")])
def test_what_is_missing_is_named(monkeypatch, missing, says):
    monkeypatch.setattr("modalprep.extras.find_spec", lambda name: None if name == missing else name)
    assert doctor.installation()["factorisation"].startswith(says)
