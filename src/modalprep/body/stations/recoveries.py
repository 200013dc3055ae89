"""What is recovered of a body with stations: what its elements strain by, in the axes of their parts (theory 4.10)."""

from __future__ import annotations

from modalprep.errors import InputError
from modalprep.fe.recovery.recover import ModelRecovery

OF_ELEMENTS = ("section_force", "force", "resultant", "stress")


def refuse_far_recoveries(recovery: ModelRecovery | None) -> None:
    """Refuse recoveries that are not linear in the modes where parts turn.

    Strains are those of the modes, and turn with the parts. Loads, accelerations and displacements of a part that
    turns do not.

    Raises
    ------
    InputError
        When a kind is not of elements, or its method is mode acceleration.

    Examples
    --------
    >>> refuse_far_recoveries(ModelRecovery({}, {}))
    """
    for name, wanted in recovery.wanted.items() if recovery else ():
        if wanted.kind not in OF_ELEMENTS:
            raise InputError(
                f"recovery {name!r} of {wanted.kind} does not work with a body of stations (large_deflection) yet, "
                f"whose parts turn; those of {', '.join(OF_ELEMENTS)} do"
            )
        if wanted.method != "displacement":
            raise InputError(
                f"recovery {name!r} by mode acceleration does not work with a body of stations (large_deflection), "
                'whose loads turn against its parts; set method = "displacement"'
            )
