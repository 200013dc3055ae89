"""Pipelines of segmented beams with another number of segments, and where their tips rest."""

from __future__ import annotations

import re

import numpy as np
from systems.shipped import PIPELINES

from modalprep.multibody.analysis.equilibrium import static_equilibrium
from modalprep.multibody.analysis.linearise import linearise
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.equations import body_states
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.read import read_system


def with_segments(name, segments, folder, changes=()):
    """System of ``pipelines/<name>.toml`` with another number of segments, and with `changes` of its words."""
    text = (PIPELINES / f"{name}.toml").read_text()
    for old, new in dict(changes).items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    beam = re.search(r"\[beams\.(\w+)\]", text)[1]
    count = int(re.search(r"segments = (\d+)", text)[1])
    text = text.replace(f"segments = {count}", f"segments = {segments}")
    return system_of(re.sub(rf"\b{beam}{count}\.", f"{beam}{segments}.", text), folder)


def system_of(text, folder):
    """System of the text of a pipeline file."""
    path = folder / "beam.toml"
    path.write_text(text)
    return read_system(load(path), None, Reporter(quiet=True))


def rest(system, t=0.0):
    """Tip of the last body (3,) in equilibrium under the loads at time t."""
    state = static_equilibrium(system, t=t)
    assert state.stable
    packed = pack(system)
    last = body_states(system, packed, state.y, np.zeros((len(packed.links), 3)))[-1]
    return last.p + last.R @ last.body.interface_position[1]


def order(errors):
    """Order of convergence from errors at n, 2 n, ... segments."""
    errors = np.abs(np.asarray(errors, dtype=float))
    return np.log2(errors[:-1] / errors[1:])


CANTILEVER = """
[beams.arm]
length = 1.0
segments = {n}
mass_per_length = 1.0
EI = {EI}
{more}
[simulation]
t_end = 1.0
"""


def cantilever(folder, n, EI="1.0", more=""):
    return system_of(CANTILEVER.format(n=n, EI=EI, more=more), folder)


def frequencies(system):
    """Of the undamped motion about the start, rad/s, ascending; each pair once."""
    return np.sort(np.abs(np.linalg.eigvals(linearise(system).A)))[::2]
