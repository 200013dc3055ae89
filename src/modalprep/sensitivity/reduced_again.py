"""Parameters of finite-element models, such as thicknesses and moduli: the body is reduced again, its modes followed.

How-to `derivatives.md` says why the derivatives of the body do not take their place.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.followed import followed
from modalprep.multibody.model.system import System
from modalprep.sensitivity.parameters import Parameter


def body_parameter(
    name: str, value: float, body: str, reduce: Callable[[float], FlexibleBody], *, size: float | None = None
) -> Parameter:
    """Return a parameter on which a body depends through its finite-element model.

    Derivatives take four bodies beside that of the system, each reduced once; their modes take the signs of the
    body's. Modes that exchange their places or mix between these values are refused.

    Parameters
    ----------
    name : str
    value : float
        That of the body in the system, such as a thickness (m) or a modulus (Pa).
    body : str
        Its name in the system.
    reduce : callable
        ``reduce(value) -> FlexibleBody``: assembly, reduction and `flexible_body` with the options of the body in the
        system.
    size : float or None
        By how much it changes noticeably; default: its value.

    Returns
    -------
    Parameter
        For `run_sensitivities`, `gradient`, `identify` and `steer`.

    References
    ----------
    W. C. Mills-Curran, Calculation of eigenvector derivatives for structures with repeated eigenvalues, AIAA J. 26
    (1988) 867: of modes of one frequency, which are refused here.

    Examples
    --------
    >>> import modalprep as mp
    >>> from modalprep.examples import beam_mesh, spinup_section
    >>> ends = {name: mp.Interface(group=name, kind="node") for name in ("root", "tip")}
    >>> def arm(Iz):
    ...     model = mp.assemble(beam_mesh(4), {"beam": spinup_section(Iz=Iz)}, ends)
    ...     return mp.flexible_body(model, mp.craig_bampton(model, modes=1), name="arm")
    >>> body_parameter("Iz", 2e-7, "arm", arm).value
    2e-07
    """
    reduced = cache(reduce)

    def change(system: System, x: float) -> System:
        return system.with_(bodies=system.bodies | {body: followed(reduced(x), system.bodies[body])})

    return Parameter(name=name, value=value, change=change, size=size)
