"""Bodies that another program has reduced: their matrices on boundary nodes, and what follows from them."""

from __future__ import annotations

from modalprep.lazy import lazy

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from modalprep.supplied.extseout import read_extseout as read_extseout
    from modalprep.supplied.reduced import body_from_reduced as body_from_reduced
    from modalprep.supplied.rows import Points as Points
    from modalprep.supplied.rows import Rows as Rows
    from modalprep.supplied.uncertainty import spin_error as spin_error
else:  # type checkers would take any name
    __getattr__, __dir__, __all__ = lazy(__name__)
