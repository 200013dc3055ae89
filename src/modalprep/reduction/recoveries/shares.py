"""Share of each mode in the static response of recovered quantities, to choose modes by what matters (theory 3.6)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.fe.recovery.recover import ModelRecovery
from modalprep.reduction.recoveries.unit_loads import Contributions, JudgedLoads


class Share(NamedTuple):
    """The largest share of one mode in one recovery, and where it is."""

    value: float
    recovery: str
    place: str
    load: str

    def words(self) -> str:
        """Return the share in words, for the reason of a mode."""
        if not self.load:
            return f"recovery share 0% in {self.recovery}"
        return f"recovery share {100 * self.value:.3g}% in {self.recovery} ({self.place}, {self.load})"


def recovery_shares(recovery: ModelRecovery, loads: JudgedLoads) -> dict[str, list[Share]]:
    """Return the share of every mode in each recovery: ``{name: [Share, ...]}``.

    The share of mode k is the largest, over loads l and components with the same unit, of its largest value
    ``|B phi_k| |phi_k^T f_l| / w_k^2`` over the recovery's largest value under that load in the full model. Loads under
    which the recovery stays below `NEGLIGIBLE` of its largest value do not count.

    References
    ----------
    Theory 3.6.
    """
    return {
        name: _shares(name, Contributions.of(q, loads), q.places, q.components)
        for name, q in recovery.quantities.items()
    }


def _shares(
    name: str, contributions: Contributions, places: tuple[str, ...], components: tuple[str, ...]
) -> list[Share]:
    peaks = np.array(
        [np.abs(contributions.modal[:, own]).max(axis=(0, 1), initial=0.0) for _, own in contributions.groups]
    )
    share = peaks[:, :, None] * np.abs(contributions.factor) / contributions.scales()[:, None]  # (groups, n, m)
    return [_share(name, contributions, share[:, k], k, places, components) for k in range(share.shape[1])]


def _share(name: str, contributions: Contributions, share: np.ndarray, k: int, places, components) -> Share:
    if not share.size or share.max() == 0:
        return Share(0.0, name, "", "")
    group, load = np.unravel_index(np.argmax(share), share.shape)
    own = np.flatnonzero(contributions.groups[group][1])
    values = np.abs(contributions.modal[:, own, k])
    place, component = np.unravel_index(np.argmax(values), values.shape)
    where = f"{places[place]}.{components[own[component]]}".strip(".")
    return Share(float(share[group, load]), name, where, contributions.label[load])
