"""Stress at the points of bodies as channels: linear in the modal coordinates, so that it follows from theirs."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from modalprep.body.flexible_body import FlexibleBody


def stress_channels(bodies: Mapping[str, FlexibleBody], channels: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return ``<body>.stress.<point>.<component>`` (nt,) in Pa, and ``.von_mises``, from ``<body>.modal (nt, n)``.

    Examples
    --------
    >>> from modalprep.body.stress import StressModes
    >>> from modalprep.examples import uniform_beam
    >>> at = StressModes(position=np.zeros(3), axes=np.eye(3), components=("xx",), modes=np.array([[2.0]]))
    >>> body = uniform_beam(modes=1).with_(stress={"root": at})
    >>> stress_channels({"arm": body}, {"arm.modal": np.array([[1.0], [-3.0]])})["arm.stress.root.von_mises"]
    array([2., 6.])
    """
    return {
        f"{name}.stress.{place}": values
        for name, body in bodies.items()
        if body.stress and body.n
        for place, values in body.stresses(channels[f"{name}.modal"]).items()
    }


def stress_reader(body: FlexibleBody, place: str) -> Callable[[np.ndarray], float] | None:
    """Return ``q (n,) -> stress`` (Pa) of ``<point>.<component>``, also ``.von_mises``; None where there is no such.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> stress_reader(uniform_beam(modes=1), "root.xx") is None
    True
    """
    point, _, component = place.rpartition(".")
    at = body.stress.get(point)
    if at is None or component not in at.histories(np.zeros(body.n)):
        return None
    return lambda q: float(at.histories(q)[component])
