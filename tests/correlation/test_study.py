"""Modes followed over the grid of a batch: table, CSV file, chart, and what is uncertain."""

import csv
import json

import numpy as np
import pytest
from batches import Inline, write_grid

from modalprep.cli import main
from modalprep.pipeline.batch import dispatch

IY, IZ = [2e-7, 9e-7], [1e-7, 4e-7, 16e-7]


@pytest.fixture(scope="module")
def grid(project, tmp_path_factory):
    """A grid of sections, run in this process."""
    folder = tmp_path_factory.mktemp("grid")
    file = write_grid(
        project, folder / "beam.toml", reduction__modes=[4], properties__beam__Iz=IZ, properties__beam__Iy=IY
    )
    text = file.read_text().replace("[reduction]", "[reduction]\ntruncation_vectors = []").replace("modes = 3\n", "", 1)
    file.write_text(text)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dispatch, "Processes", Inline)
        assert main(["batch", str(file), "--quiet"]) == 0
    return file


def test_modes_of_a_batch_keep_their_number_through_crossings(grid, capsys):
    """Bending in each plane has ``f ~ sqrt(I)`` of its own: the product f / sqrt(I) is constant for one mode."""
    assert main(["batch", str(grid), "--track", "clamped", "--json"]) == 0
    (tracked,) = json.loads(capsys.readouterr().out)["tracked"]
    with (grid.parent / "output" / "beam-modes.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 24
    families: dict[str, dict] = {}
    for row in rows:
        families.setdefault(row["mode"], []).append(row)
    crossings = 0
    for own in families.values():
        scaled = [[float(r["frequency_Hz"]) / float(r[key]) ** 0.5 for r in own] for key in ("Iy", "Iz")]
        assert min(np.ptp(values) / np.mean(values) for values in scaled) < 5e-3  # shear: (h / L)^2
        crossings += len({row["place"] for row in own}) > 1
        assert all(float(row["mac"]) > 0.99 and not row["uncertain"] for row in own)
    assert crossings >= 2
    assert tracked["notes"] == []
    assert (grid.parent / "output" / "beam-modes.png").stat().st_size > 10_000


def test_uncertain_numbers_are_said(grid, capsys):
    """Bodies of other shapes under the same places: the MAC is low."""
    from modalprep.correlation import Study, body_modes, track_modes
    from modalprep.examples import uniform_beam

    modes = body_modes(uniform_beam(modes=2))
    mixed = modes.with_(shape=modes.shape @ np.array([[1.0, 0.9], [-0.9, 1.0]]))
    cases = {(0,): modes, (1,): mixed}
    study = Study(name="arm", parameters=("E",), levels=((1, 2),), modes=cases, tracks=track_modes(cases))
    assert len(study.uncertainties()) == 2
    assert "mode 1 at E = 2 has a low MAC with its neighbour, 0.5" in study.uncertainties()[0]
    assert {row["uncertain"] for row in study.rows()} == {"", "low MAC"}


@pytest.mark.parametrize(
    ("track", "edit", "said"),
    [
        ("held", lambda text: text, "held"),
        ("clamped", lambda text: text.split("[grid]")[0], "none of the files has one"),
    ],
)
def test_what_cannot_be_followed_is_refused_before_any_job(grid, tmp_path, capsys, track, edit, said):
    file = tmp_path / "other.toml"
    file.write_text(edit(grid.read_text()))
    assert main(["batch", str(file), "--track", track]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.splitlines()) == 1
    assert not list(tmp_path.rglob("batch.json"))


def test_a_missing_case_is_left_out_and_named(grid, tmp_path, capsys):
    output = grid.parent / "output"
    body = output / "beam-modes=4-Iz=4e-07-Iy=2e-07" / "beam-modes=4-Iz=4e-07-Iy=2e-07.h5"
    hidden = body.rename(tmp_path / "hidden.h5")
    try:
        from modalprep.pipeline.batch.plan import plan_batch
        from modalprep.pipeline.batch.tracks import grids, write_tracks
        from modalprep.pipeline.console import Reporter

        (jobs,) = grids(plan_batch([str(grid)], None), "clamped")
        found = write_tracks(jobs, "clamped", Reporter())
    finally:
        hidden.rename(body)
    assert "Iz=4e-07-Iy=2e-07 is left out" in found["notes"][0]
    assert "left out" in capsys.readouterr().out
