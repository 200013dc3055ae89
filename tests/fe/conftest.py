"""Decks of Nastran in a folder of their own."""

import pytest

from modalprep.fe.readers.nastran.deck import read_nastran


@pytest.fixture
def read(tmp_path):
    """Return ``read(text)``: the mesh of a deck."""

    def reader(text, length=1.0, mass=1.0, end="ENDDATA\n", name="deck.bdf", ignore=()):
        (tmp_path / name).write_text(text + end)
        return read_nastran(tmp_path / name, length, mass, ignore)

    return reader
