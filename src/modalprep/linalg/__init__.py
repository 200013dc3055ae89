"""Linear algebra on matrices: factorisation, lowest modes, Rayleigh-Ritz."""

from __future__ import annotations

from modalprep.lazy import lazy

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from modalprep.linalg.factor import Factor as Factor
    from modalprep.linalg.factor import factorise as factorise
    from modalprep.linalg.modes import Modes as Modes
    from modalprep.linalg.modes import lowest_modes as lowest_modes
else:  # type checkers would take any name
    __getattr__, __dir__, __all__ = lazy(__name__)
