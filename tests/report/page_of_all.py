"""A page with every kind of section, made without an assembly or an eigenvalue problem."""

import numpy as np
from PIL import Image

from modalprep.body.checks import Check
from modalprep.report import Section, Table, paragraph
from modalprep.report.body_page.inputs import Inputs
from modalprep.report.page import BodyPage, write_page
from modalprep.verdicts.verdict import Requirement

CHECKS = [Check("mass", 1e-12, 1e-9, "body = mesh"), Check("modal mass", 2e-3, 1e-7, "P sums to 1")]
NOTES = ["all 3 fixed-interface modes below 9 Hz were found (a)", "its mass is implausible", "rebuilt: P"]


def tables(rows: int) -> dict[str, Table]:
    """Return tables of inputs, and one that shades its cells."""
    masses = [(f"group_{k}", "shell", f"{k} quad", 0.1 * k, 1.5 * k, 100 / rows) for k in range(1, rows + 1)]
    columns = ("group", "type", "elements", "volume (m³)", "mass (kg)", "share (%)")
    total = ("sum", "", "", 1.0, sum(row[4] for row in masses), 100.0)
    groups = [f"group_{k}" for k in range(16)]
    shares = np.random.default_rng(0).dirichlet(np.ones(16), rows) * 100
    shares[0], shares[0, 0] = 0.0, 100.0
    return {
        "mass": Table(name="mass-by-group", columns=columns, rows=masses, total=total, caption="Mass of each group."),
        "strain": Table(name="strain-energy", columns=("mode", "Hz", *groups), heat=groups, caption="Strain energy.",
                        rows=[(k + 1, 2.0 * k, *row) for k, row in enumerate(shares.tolist())]),
    }  # fmt: skip


def whole_page(body, folder, rows=20):
    """Write the page of a body."""
    picture = folder / "picture.png"
    Image.fromarray(np.full((300, 400, 3), 200, dtype=np.uint8)).save(picture)
    made = tables(rows)
    extra = Table(
        name="struts", columns=("strut", "N (N)", "result"), rows=[("left", 2.0, "FAILED"), ("right", 1.0, "passed")]
    )
    section = Section(title="Strut forces", anchor="strut-section", html=paragraph("At 3 sigma.") + extra.html(),
                      requirements=[Requirement(name="left strut", result="FAILED", says="-0.2")])  # fmt: skip
    inputs = Inputs(
        tables=[made["mass"]], energies=[made["strain"]], text="[mesh]\nfile = 'a.msh'\n" * 20,
        files={"a.msh": "ab" * 32}, made={"host": "machine"},
    )  # fmt: skip
    return write_page(BodyPage(
        body, pictures={1: picture, 2: picture}, mesh_picture=picture, checks=CHECKS,
        notes=NOTES, plots=[("Spin-up", picture)], errors={"e": ([1.0, 2.0], [1e-6, 1e-4])}, inputs=inputs,
        sections=[section],
    ), folder / "whole.html")  # fmt: skip
