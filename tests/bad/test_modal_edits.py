"""Random edits of modal files: what is read is the body that was written, to 1e-6, or nothing is.

`MODALPREP_FULL=5` makes 500 files of each kind, and others each time.
"""

from contextlib import suppress
from dataclasses import fields

import h5py
import numpy as np
import pytest
from bad import good
from bad.mutations import of_bytes
from bad.test_fuzz import bounded
from hypothesis import given
from hypothesis import strategies as st

import modalprep as mp

CONSEQUENCE = 1e-6  # relative; smaller changes do not matter to any result
FACTORS = [-1.0, 0.0, 0.5, 2.0, 1e3, 1e-3, 1e76, 1 + 1e-5, 1 + 1e-3, 1.01, float("nan"), float("inf")]
TEXTS = ["", "mm", "tip", "0", "another"]
COUNTS = [0, -1, 1, 2, 3, 10**9]


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A body with modes, interfaces, cells, energy and stress."""
    return good.write_good(tmp_path_factory.mktemp("edits")) / "body.h5"


@pytest.fixture(scope="module")
def original(file):
    return mp.read_body(file)


def everything(file):
    """Return the paths of all groups and datasets."""
    names = ["/"]
    with h5py.File(file) as h5:
        h5.visit(names.append)
    return names


def values(found):
    """Return what a record holds by path, records inside it and dictionaries followed."""
    if isinstance(found, dict):
        inner = found.items()
    elif hasattr(found, "__dataclass_fields__"):
        inner = [(field.name, getattr(found, field.name)) for field in fields(found)]
    else:
        return {"": found}
    return {f"{name}.{rest}": value for name, part in inner for rest, value in values(part).items()}


def same(a, b):
    """Whether two bodies are the same to `CONSEQUENCE`, and to the letter in all that is text."""
    a, b = values(a), values(b)
    return a.keys() == b.keys() and all(_alike(a[name], b[name]) for name in a)


def _alike(x, y):
    if not isinstance(x, (float, np.ndarray)):
        return x == y
    x, y = np.asarray(x), np.asarray(y)
    scale = np.abs(np.nan_to_num(y.astype(float))).max(initial=0.0)
    return x.shape == y.shape and np.allclose(x, y, rtol=0.0, atol=CONSEQUENCE * scale, equal_nan=True)


def read_as_written_or_refused(path, original):
    """Read a body; what is refused raises an `InputError`, and every other exception fails the test."""
    with suppress(mp.InputError):
        assert same(mp.read_body(path), original)


def _number(draw, data):
    """Change one number, or all, of a dataset."""
    array = data[()]
    if array.dtype.names or array.dtype.kind not in "fiu" or not array.size:
        return
    if not array.ndim:
        data[()] = array * draw(st.sampled_from(FACTORS))
        return
    flat, k = array.ravel(), draw(st.integers(0, array.size - 1))
    if array.dtype.kind == "f":
        chosen = slice(None) if draw(st.booleans()) else k
        with np.errstate(all="ignore"):
            flat[chosen] = (flat[chosen] + draw(st.sampled_from([0.0, 1.0]))) * draw(st.sampled_from(FACTORS))
    else:
        flat[k] = draw(st.sampled_from(COUNTS))
    data[...] = flat.reshape(array.shape)


def _order(draw, data):
    """Reverse an axis, or exchange two."""
    array = data[()]
    if isinstance(array, np.ndarray) and array.ndim:
        data[...] = np.flip(array, axis=draw(st.integers(0, array.ndim - 1)))
        if array.ndim > 1 and array.shape[-1] == array.shape[-2] and draw(st.booleans()):
            data[...] = np.swapaxes(array, -1, -2)


def _row(draw, data):
    """Change one column of one row of the table of modes."""
    if data.dtype.names:
        rows = data[()]
        name, k = draw(st.sampled_from(data.dtype.names)), draw(st.integers(0, len(rows) - 1))
        kind = rows.dtype[name]
        rows[name][k] = draw(st.sampled_from(TEXTS)) if kind.hasobject else draw(st.sampled_from([0, 1, 7]))
        data[...] = rows


def _attribute(draw, item):
    """Change or remove an attribute."""
    if not len(item.attrs):
        return
    name = draw(st.sampled_from(sorted(item.attrs)))
    if draw(st.booleans()):
        del item.attrs[name]
        return
    old = item.attrs[name]
    numbers = np.asarray(old).dtype.kind in "fiu"
    item.attrs[name] = old * draw(st.sampled_from([0, 2, -1])) if numbers else draw(st.sampled_from(TEXTS))


def _away(draw, item):
    """Remove a dataset or a group."""
    if item.name != "/":
        del item.parent[item.name.rpartition("/")[2]]


def _moved(draw, item):
    """Give it another name."""
    if item.name != "/":
        item.parent.move(item.name.rpartition("/")[2], draw(st.sampled_from(["K", "energy", "T", "modal_mass", "x"])))


@bounded(100)
@given(data=st.data())
def test_one_edit(file, original, data):
    edited = file.with_name("edited.h5")
    edited.write_bytes(file.read_bytes())
    name = data.draw(st.sampled_from(everything(file)))
    with h5py.File(edited, "a") as h5:
        item = h5[name]
        edits = (
            (_attribute, _away, _moved) if isinstance(item, h5py.Group) else (_number, _order, _row, _away, _attribute)
        )
        try:
            data.draw(st.sampled_from(edits))(data.draw, item)
        except ValueError:  # of HDF5: the name is taken
            return
    read_as_written_or_refused(edited, original)


@bounded(100)
@given(data=st.data())
def test_changed_bytes(file, original, data):
    edited = file.with_name("edited.h5")
    edited.write_bytes(data.draw(of_bytes(file.read_bytes())))
    read_as_written_or_refused(edited, original)


def test_an_edit_has_a_consequence(file):
    """The comparison of this page sees what it is for."""
    body = mp.read_body(file)
    assert same(body, mp.read_body(file))
    for name in ("K", "P", "Kg_W", "shape", "psi"):
        changed = getattr(body, name).copy()
        changed[np.unravel_index(np.abs(changed).argmax(), changed.shape)] *= 1 + 2 * CONSEQUENCE
        assert not same(body.with_(**{name: changed}, energy=body.energy, stress=body.stress), body), name
    assert not same(body.with_(name="rod"), body)
