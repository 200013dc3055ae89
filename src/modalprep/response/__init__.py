"""Linear responses of a body and what is made of them: shock spectra, fatigue, force limits and notches."""

from __future__ import annotations

from modalprep.lazy import lazy

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from modalprep.response.fatigue import Fatigue as Fatigue
    from modalprep.response.fatigue import rainflow_damage as rainflow_damage
    from modalprep.response.fatigue import random_damage as random_damage
    from modalprep.response.fatigue import signed_von_mises as signed_von_mises
    from modalprep.response.limits import Notch as Notch
    from modalprep.response.limits import NotchedInput as NotchedInput
    from modalprep.response.limits import force_limit as force_limit
    from modalprep.response.limits import notch as notch
    from modalprep.response.limits import quasi_static_limit as quasi_static_limit
    from modalprep.response.shock import ShockSpectrum as ShockSpectrum
    from modalprep.response.shock import shock_spectrum as shock_spectrum
    from modalprep.response.shock import vibration_spectrum as vibration_spectrum
    from modalprep.response.sn_curve import SNCurve as SNCurve

_NAMES = {
    "shock": "ShockSpectrum shock_spectrum vibration_spectrum",
    "fatigue": "Fatigue rainflow_damage random_damage signed_von_mises",
    "sn_curve": "SNCurve",
    "limits": "Notch NotchedInput notch force_limit quasi_static_limit",
}
if not TYPE_CHECKING:  # to which other names are mistakes
    __getattr__, __dir__, __all__ = lazy(__name__, _NAMES)
