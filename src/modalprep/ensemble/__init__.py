"""Ensembles: one system, many cases."""

from __future__ import annotations

from modalprep.lazy import lazy

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from modalprep.ensemble.cases import draw_cases as draw_cases
    from modalprep.ensemble.file import read_ensemble as read_ensemble
    from modalprep.ensemble.file import write_ensemble as write_ensemble
    from modalprep.ensemble.record import Ensemble as Ensemble
else:  # type checkers would take any name
    __getattr__, __dir__, __all__ = lazy(__name__)
