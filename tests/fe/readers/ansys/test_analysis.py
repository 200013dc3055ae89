"""What an Ansys deck says of its analysis: forces, gravity, modes, damping, master DOFs."""

import numpy as np
import pytest
from fe.ansys_decks import SHEET, STEEL, deck

import modalprep as mp

NODES = [f"N,{k},{x},{y},{z}" for k, (x, y, z) in enumerate(SHEET, 1)]
SHELL = ["ET,1,181", *STEEL, "SECTYPE,1,SHELL", "SECDATA,.01", "SECNUM,1", *NODES, "E,1,2,3,4"]


def read(folder, *lines, units=("m", "kg")):
    return mp.read_mesh(deck(folder, [*SHELL, *lines]), *units)


def test_forces(tmp_path):
    """The last of two at one DOF counts; in mm and t a moment is N mm."""
    mesh = read(tmp_path, "F,2,FZ,1.", "F,2,FZ,5.,0.", "F,4,FX,2.", "F,4,MY,3.", units=("mm", "t"))
    load = mesh.loads["forces"]
    np.testing.assert_allclose(load.forces, [[0, 0, 5], [2, 0, 0]])
    np.testing.assert_allclose(load.moments, [[0, 0, 0], [0, 3e-3, 0]])
    assert mesh.cases[0].loads == ("forces",)


def test_forces_along_turned_axes(tmp_path):
    mesh = mp.read_mesh(deck(tmp_path, [*SHELL[:-1], "N,5,2,0,0,90", "E,1,2,3,4", "F,5,FX,3."]))
    np.testing.assert_allclose(mesh.loads["forces"].forces, [[0, 3, 0]], atol=1e-12)


def test_gravity_is_opposite_to_the_acceleration_of_the_ground(tmp_path):
    [case] = read(tmp_path, "ACEL,0,0,9810.", units=("mm", "t")).cases
    np.testing.assert_allclose(case.gravity, [0, 0, -9.81])


def test_modes(tmp_path):
    [case] = read(tmp_path, "MODOPT,LANB,8,5.,400.,OFF").cases
    assert (case.modes, case.lowest, case.highest) == (8, 5.0, 400.0)


@pytest.mark.parametrize(
    ("lines", "damping"),
    [
        (["ALPHAD,2.", "BETAD,3.E-5"], {"alpha": 2.0, "beta": 3e-5}),
        (["DMPRAT,.02"], 0.02),
        (["DMPSTR,.04"], 0.02),
        (["MP,ALPD,1,2."], {"alpha": 2.0, "beta": 0.0}),
        (["MP,DAMP,1,3.E-5"], {"alpha": 0.0, "beta": 3e-5}),
        (["MP,DMPR,1,.02"], 0.02),
        (["MP,DMPR,1,.02", "DMPRAT,.03"], 0.03),
    ],
)
def test_damping(tmp_path, lines, damping):
    assert read(tmp_path, *lines).cases[0].damping == damping


def test_damping_of_several_materials_is_said(tmp_path):
    [case] = read(tmp_path, "MP,DMPR,1,.02", "MP,EX,2,1e9").cases
    assert case.damping is None
    assert "damping of their own each" in case.said[0]


def test_master_dofs_are_a_group(tmp_path):
    mesh = read(tmp_path, "M,2,ALL", "M,3,UX,,,UY")
    assert mesh.labels[mesh.nodes("master")].tolist() == [2, 3]


def test_what_is_not_used_is_said_and_zeros_are_not(tmp_path):
    quiet = ["OMEGA,0.,0.,0.", "ACEL,0.,0.,0.", "ALPHAD,0.", "DMPRAT,0."]
    assert read(tmp_path, *quiet).cases == ()
    [case] = read(tmp_path, *quiet, "SFE,1,2,PRES,1,5.", "OMEGA,0,0,3.", "F,ALL,FX,1.").cases
    assert "1 SFE" in case.said[0]
    assert "1 OMEGA" in case.said[0]
    assert "1 F (" in case.said[0]
