"""Correlation of modes: with those of a test, of another model, and along a study."""

from __future__ import annotations

from modalprep.lazy import lazy

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from modalprep.correlation.criteria import comac as comac
    from modalprep.correlation.criteria import cross_orthogonality as cross_orthogonality
    from modalprep.correlation.criteria import mac as mac
    from modalprep.correlation.derivatives import Sensitivities as Sensitivities
    from modalprep.correlation.derivatives import sensitivities as sensitivities
    from modalprep.correlation.measured import read_test_modes as read_test_modes
    from modalprep.correlation.mode_set import ModeSet as ModeSet
    from modalprep.correlation.mode_set import body_modes as body_modes
    from modalprep.correlation.pairing import Correlation as Correlation
    from modalprep.correlation.pairing import correlate as correlate
    from modalprep.correlation.sensors import choose_sensors as choose_sensors
    from modalprep.correlation.sensors import expand as expand
    from modalprep.correlation.sensors import synthetic_test as synthetic_test
    from modalprep.correlation.study import Study as Study
    from modalprep.correlation.tracking import Tracks as Tracks
    from modalprep.correlation.tracking import track_modes as track_modes
    from modalprep.correlation.written import write_test_modes as write_test_modes
else:  # type checkers would take any name
    __getattr__, __dir__, __all__ = lazy(__name__)
