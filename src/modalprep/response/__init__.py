"""Linear responses of one body whose root is driven: harmonic, sine sweep, random, transient (theory 11.1).

The root interface moves as prescribed, and forces and moments act on the other interfaces. Inputs are named
``base.x``, ..., ``base.rz`` (acceleration of the root, m/s^2 and rad/s^2) and ``<interface>.x``, ...,
``<interface>.rz`` (force, N, and moment, N m). Every channel of a response has a name of three parts, as in runs:

- ``base.force.x``, ``base.moment.x``: what the base exerts on the body at its root (N, N m);
- ``<interface>.acceleration.x``, ``<interface>.angular_acceleration.x``: of each interface (m/s^2, rad/s^2);
- ``<interface>.displacement.x``, ``<interface>.rotation.x``: of each but the root, relative to the root (m, rad);
- ``<recovery>.<place>.<component>``: of the recoveries of the body, with ``.von_mises`` of stress.

Vectors are in the axes of the body's frame, recoveries in their own. Gravity and what is static are not part of a
response.
"""

from __future__ import annotations

from modalprep.lazy import lazy

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from modalprep.response.fatigue import Fatigue as Fatigue
    from modalprep.response.fatigue import rainflow_damage as rainflow_damage
    from modalprep.response.fatigue import random_damage as random_damage
    from modalprep.response.fatigue import signed_von_mises as signed_von_mises
    from modalprep.response.harmonic import harmonic_response as harmonic_response
    from modalprep.response.inputs import History as History
    from modalprep.response.inputs import Spectrum as Spectrum
    from modalprep.response.limits import Notch as Notch
    from modalprep.response.limits import NotchedInput as NotchedInput
    from modalprep.response.limits import force_limit as force_limit
    from modalprep.response.limits import notch as notch
    from modalprep.response.limits import quasi_static_limit as quasi_static_limit
    from modalprep.response.modal import ModalEquations as ModalEquations
    from modalprep.response.modal import modal_equations as modal_equations
    from modalprep.response.power import PowerSpectrum as PowerSpectrum
    from modalprep.response.power import power_spectrum as power_spectrum
    from modalprep.response.random import random_response as random_response
    from modalprep.response.result import Peak as Peak
    from modalprep.response.result import Response as Response
    from modalprep.response.shock import ShockSpectrum as ShockSpectrum
    from modalprep.response.shock import shock_spectrum as shock_spectrum
    from modalprep.response.shock import vibration_spectrum as vibration_spectrum
    from modalprep.response.sn_curve import SNCurve as SNCurve
    from modalprep.response.sweep import sweep_response as sweep_response
    from modalprep.response.transient import transient_response as transient_response
else:  # type checkers would take any name
    __getattr__, __dir__, __all__ = lazy(__name__)
