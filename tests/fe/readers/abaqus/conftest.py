"""Decks of Abaqus in a folder of their own."""

import pytest

import modalprep as mp


@pytest.fixture
def read(tmp_path):
    """Return ``read(text)``: the mesh of a deck, in m and kg unless told otherwise."""

    def reader(text, *args, **more):
        (tmp_path / "deck.inp").write_text(text)
        return mp.read_mesh(tmp_path / "deck.inp", *args, **more)

    return reader
