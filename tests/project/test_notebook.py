"""Records as one line, and as tables of notebooks: well-formed, escaped, a row for each thing."""

from xml.etree import ElementTree

import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import cantilever_model, uniform_beam

EVIL = "<script>alert('&')<br>"


def result():
    channels = {"hinge.angle": np.array([0.5, -2.0, 1.0]), f"{EVIL}.force": np.arange(9.0).reshape(3, 3)}
    return mp.Result(time=np.arange(3.0), channels=channels, status="done", message="")


def system():
    hinge = mp.Joint(name=EVIL, type="revolute", parent="ground", child="arm")
    weld = mp.Joint(name="weld", type="weld", parent="arm.tip", child="tail")
    push = mp.PointForce(name="push", at="arm.tip", force=np.ones(3))
    bodies = {"arm": uniform_beam(modes=2), "tail": uniform_beam(modes=1)}
    return mp.System(bodies=bodies, joints=(hinge, weld), loads=(push,))


def table():
    found = mp.craig_bampton(cantilever_model(tip="fixed"), modes=3).table
    return found.with_(reason=(EVIL, *found.reason[1:]))


RECORDS = {"result": (result, 4), "system": (system, 2), "modes": (table, 16)}  # rows


@pytest.mark.parametrize("kind", RECORDS)
def test_one_line(kind):
    text = repr(RECORDS[kind][0]())
    assert "\n" not in text
    assert len(text) < 120


def test_the_line_counts():
    assert repr(result()) == "Result(done, 0..2 s in 3 times, 2 channels)"
    assert repr(system()) == "System(2 bodies with 3 modes, 2 joints, 1 load)"
    assert repr(table()).startswith("ModeTable(16 of 16 candidates kept, ")


@pytest.mark.parametrize("kind", RECORDS)
def test_tables_are_well_formed_and_escaped(kind):
    make, count = RECORDS[kind]
    text = make()._repr_html_()
    assert "<script" not in text
    caption, header, *rows = ElementTree.fromstring(text)
    assert caption.text == repr(make())
    assert len(rows) == count
    assert {len(row) for row in rows} == {len(header)}
    assert any(EVIL in (cell.text or "") for row in rows for cell in row)


def test_tables_have_the_values():
    cells = [[cell.text for cell in row] for row in ElementTree.fromstring(result()._repr_html_())[2:]]
    assert ["hinge.angle", "-2", "1", "1"] in cells
    assert [f"{EVIL}.force.y", "1", "7", "7"] in cells
    joints = [[cell.text for cell in row] for row in ElementTree.fromstring(system()._repr_html_())[2:]]
    assert joints[1] == ["weld", "weld", "arm.tip", "tail", "12", "1"]


def test_channels_without_numbers_have_no_extremes():
    run = mp.Result(time=np.zeros(1), channels={"a": np.array([np.nan])}, status="done", message="")
    assert [cell.text for cell in ElementTree.fromstring(run._repr_html_())[2]] == ["a", "nan", "nan", "nan"]
