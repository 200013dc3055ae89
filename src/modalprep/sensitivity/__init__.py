"""Derivatives of runs: forward sensitivities of channels, and gradients of one number by the discrete adjoint."""

from __future__ import annotations

from modalprep.lazy import lazy

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from modalprep.sensitivity.gradient import Gradient as Gradient
    from modalprep.sensitivity.identification import Identified as Identified
    from modalprep.sensitivity.objective import Objective as Objective
    from modalprep.sensitivity.objective import integral as integral
    from modalprep.sensitivity.objective import last as last
    from modalprep.sensitivity.objective import squares as squares
    from modalprep.sensitivity.parameters import Parameter as Parameter
    from modalprep.sensitivity.parameters import changed as changed
    from modalprep.sensitivity.reduced_again import body_parameter as body_parameter
    from modalprep.sensitivity.run_sensitivities import RunSensitivities as RunSensitivities
    from modalprep.sensitivity.shooting import Steering as Steering
else:  # type checkers would take any name
    __getattr__, __dir__, __all__ = lazy(__name__)
