"""Channels as labelled arrays of xarray: one loop for all records that have channels."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from modalprep.extras import need

if TYPE_CHECKING:
    import xarray


def labelled(
    record: Any,
    names: Iterable[str],
    components: Callable[[str], Sequence[str]],
    axes: Mapping[str, Any],
    attributes: Mapping[str, Any] | None = None,
) -> xarray.Dataset:
    """Return channels as labelled arrays.

    Parameters
    ----------
    record : Result or Ensemble
        Its items are the channels.
    names : sequence of str
    components : callable
        ``name -> names`` of the components of a channel; none of a channel with one.
    axes : mapping
        Coordinates; those with arrays of their own are the first dimensions of every channel.
    attributes : mapping, optional
        Of the whole.

    Raises
    ------
    NotInstalledError
        When xarray is not installed.
    InputError
        When there is no such channel.
    """
    need("xarray", "a labelled array")
    import xarray

    first = [name for name, values in axes.items() if not isinstance(values, tuple)]
    data = {}
    coordinates = dict(axes)
    for name in names:
        parts = components(name)
        label = "axis" if list(parts) == list("xyz") else f"component_{len(parts)}"
        data[name] = ((*first, *([label] if parts else [])), record[name])
        coordinates |= {label: list(parts)} if parts else {}
    return xarray.Dataset(data, coordinates, dict(attributes or {}))
