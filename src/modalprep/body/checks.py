"""Physics checks of a model and of its modal body: identities that a wrong sign or unit violates."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from modalprep.body.deflection import mass_at
from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import rigid_mass_matrix, stated_mass_matrix
from modalprep.records import Record
from modalprep.suggest import refuse_other
from modalprep.verdicts.notes import warn, warnings_of
from modalprep.verdicts.verdict import FAILED, PASSED, Requirement, Verdict

if TYPE_CHECKING:
    from modalprep.fe.assembly.model import FEModel

IDENTITY = 1e-9  # relative; sums over 1e5..1e6 entries lose up to six of sixteen digits
ORTHOGONAL = 1e-7  # the modes are orthonormal to 1e-8
NOISE = 1e-6  # relative to the largest row: rows of round-off only, such as a rod's rotation across its axis
RIGID = 1e-8  # strain force of a rigid motion over its absolute terms
LARGEST = 1e20  # light parts of heavy bodies reach 1e13, as of a satellite whose panels have local modes
BENT = 0.2  # of the body's size: beyond the range of small strains
TRIALS = 16  # random deflections, beside the answer to each load


@dataclass(frozen=True)
class Check:
    """One check: a relative error that must stay below a limit.

    Attributes
    ----------
    name : str
    value, limit : float
        The relative error, and what it must stay below.
    meaning : str
        What is compared, in words.
    required : bool
        False: for information.
    """

    name: str
    value: float
    limit: float
    meaning: str
    required: bool = True

    @property
    def passed(self) -> bool:
        """Whether the value is within the limit, or the check is not required."""
        return self.within or not self.required

    @property
    def within(self) -> bool:
        """Whether the value is finite and within the limit."""
        return bool(self.value <= self.limit)

    @property
    def result(self) -> str:
        """``passed``, ``failed``, or ``warning`` of a value beyond a limit that is not required."""
        return "passed" if self.within else "failed" if self.required else "warning"

    @property
    def says(self) -> str:
        """Value, limit and meaning."""
        return f"{self.value:.1e}, limit {self.limit:.0e}: {self.meaning}"

    def row(self) -> dict[str, Any]:
        """Return the check as plain JSON; a value that is not finite becomes null.

        Returns
        -------
        dict
            The fields, whether it ``passed``, and its ``result``.
        """
        value = self.value if np.isfinite(self.value) else None
        return vars(self) | {"passed": self.passed, "result": self.result, "value": value}


@dataclass(frozen=True, eq=False, kw_only=True)
class CheckReport(Record):
    """Checks of one subject.

    Attributes
    ----------
    subject : str
        The checked file.
    checks : tuple of Check
    notes : tuple of str
        What to know beside the checks, such as what of a supplied body is rebuilt.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> report = CheckReport(subject="beam", checks=tuple(check_body(uniform_beam(modes=2))))
    >>> report.passed, report.failed
    (True, ())
    """

    subject: str
    checks: tuple[Check, ...]
    notes: tuple[str, ...] = ()

    @property
    def failed(self) -> tuple[Check, ...]:
        """The required checks that did not pass."""
        return tuple(check for check in self.checks if not check.passed)

    @property
    def passed(self) -> bool:
        """Whether every required check passed."""
        return not self.failed

    @property
    def verdict(self) -> Verdict:
        """PASS, PASS WITH WARNINGS or FAIL, with the reasons."""
        return Verdict.of(required_checks(self.checks), (*beyond(self.checks), *warnings_of(self.notes)))

    def summary(self) -> dict[str, Any]:
        """Return the report as plain JSON; a value that is not finite becomes null.

        Returns
        -------
        dict
            Plain JSON, by the names of the fields.
        """
        rows = [c.row() for c in self.checks]
        found = {"subject": self.subject, "passed": self.passed, "checks": rows, "notes": list(self.notes)}
        return found | {"verdict": self.verdict.summary()}


def required_checks(checks: Iterable[Check]) -> list[Requirement]:
    """Return the requirements of checks; of those beyond a limit that is not required see `beyond`."""
    return [
        Requirement(
            name=check.name, result=PASSED if check.within else FAILED, anchor=f"check-{number}", says=check.says
        )
        for number, check in enumerate(checks, start=1)
        if check.within or check.required
    ]


def beyond(checks: Iterable[Check]) -> list[str]:
    """Return a warning of each check beyond a limit that is not required.

    Examples
    --------
    >>> beyond([Check("buckling load tip", 0.3, 0.1, "3 N on 'tip', of the mesh 2 N", required=False)])
    ["buckling load tip: 3.0e-01, limit 1e-01: 3 N on 'tip', of the mesh 2 N"]
    """
    return [f"{check.name}: {check.says}" for check in checks if check.passed and not check.within]


def check_model(model: FEModel) -> list[Check]:
    """Check an assembled model against the identities of theory 1.

    Returns
    -------
    list of Check
        One for each identity, with its relative residual and the limit.

    References
    ----------
    Theory 1.5 and 6.1.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> all(check.passed for check in check_model(cantilever_model()))
    True
    """
    from modalprep.fe.assembly.model import FEModel  # not where a modal file is read

    refuse_other("check_model: the model", FEModel, model)
    R = model.rigid_body()
    r = model.rigid
    T = R[:, :3]
    terms = abs(model.K) @ np.abs(R)
    moved = np.abs(model.K @ R) / np.maximum(terms, max(NOISE * terms.max(), np.finfo(float).tiny))
    mass = relative(R.T @ model.M @ R, rigid_mass_matrix(r.m, r.s0, r.E0))
    g_T = relative(model.g.T @ T, r.m * np.eye(3))
    size = float(np.ptp(model.points, axis=0).max())
    h_T = relative(np.einsum("dab,dc->abc", model.h, T), np.einsum("ac,b->abc", np.eye(3), r.s0), floor=r.m * size)
    return [
        Check("rigid motions are free of strain", float(moved.max()), RIGID, "K times a rigid motion is zero"),
        Check("mass of the mesh", mass, IDENTITY, "rigid mass matrix from M = from m, s0, E0"),
        Check("translation vectors", g_T, IDENTITY, "g . unit translation = mass"),
        Check("position vectors", h_T, IDENTITY, "h . unit translation = s0"),
    ]


def check_body(body: FlexibleBody) -> list[Check]:
    """Check a modal body, also one read from a file.

    Returns
    -------
    list of Check
        One for each identity, with its relative residual and the limit.

    References
    ----------
    Theory 6.2.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> [check.name for check in check_body(uniform_beam(modes=2)) if not check.passed]
    []
    """
    refuse_other("check_body: the body", FlexibleBody, body)
    with np.errstate(all="ignore"):  # what is not finite does not pass
        bent = float(np.max([indefinite(mass_at(body, BENT * q)) for q in deflections(body)], initial=0.0))
    meaning = f"and with deflections of {BENT:.0%} of the body's size"
    checks = [*check_identities(body), Check("mass matrix, bent", bent, IDENTITY, meaning)]
    warn(f"check of {body.name!r}: {check.name}: {check.says}" for check in checks if not check.within)
    return checks


def check_identities(body: FlexibleBody) -> list[Check]:
    """Check the identities of a modal body that cost no deflections, so that every file is checked when it is read.

    Returns
    -------
    list of Check
        One for each identity, with its relative residual and the limit.

    References
    ----------
    Theory 6.2.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> beam = uniform_beam(modes=2)
    >>> [check.name for check in check_identities(beam.with_(D=-beam.frequency)) if not check.passed]
    ['modal damping']
    """
    with np.errstate(all="ignore"):
        return _identities(body)


def _identities(body: FlexibleBody) -> list[Check]:
    rigid = rigid_mass_matrix(body.m, body.s0, body.E0)
    Kg = [body.Kg_A, body.Kg_W, body.Kg_F, body.Kg_T, *([] if body.T is None else [body.T])]
    asymmetry = max((relative(k, np.swapaxes(k, -1, -2)) for k in Kg if k.size), default=0.0)
    trace = body.P[0, 0] + body.P[1, 1] + body.P[2, 2]
    modal_mass = relative(trace, body.modal_mass)
    tensor = relative(body.P, body.P.transpose(1, 0, 3, 2))
    stiffness = relative(body.K, (2 * np.pi * body.frequency) ** 2) if np.all(body.K >= 0) else float("inf")
    mass = relative(np.diag(rigid), body.modes.total)
    damping = float(max(0.0, -body.D.min(initial=0.0)))
    dampers = () if body.coupled_damping is None else (indefinite(body.coupled_damping),)
    return [
        Check("mass and inertia", mass, IDENTITY, "of the modal body = of the mesh"),
        Check(
            "inertia is physical", _inertia_defect(rigid[3:, 3:]), IDENTITY, "no moment exceeds the sum of the others"
        ),
        Check("modal mass", modal_mass, ORTHOGONAL, "P_11 + P_22 + P_33, 1 where the modes are normalised"),
        Check("mass tensor", tensor, IDENTITY, "P_ab = P_ba^T"),
        Check("modal stiffness", stiffness, IDENTITY, "K = (2 pi f)^2, not negative"),
        Check("modal damping", damping, 0.0, "D is not negative"),
        *(Check("damping matrix", value, IDENTITY, "no motion gains energy by dampers") for value in dampers),
        Check("geometric stiffness", asymmetry, IDENTITY, "Kg is symmetric, T in its last two modes"),
        Check("mass matrix", indefinite(stated_mass_matrix(body)), IDENTITY, "positive definite without deflection"),
        Check("sizes", _largest(body), LARGEST, "of modes and Kg, in units of the body's mass and size"),
    ]


def _largest(body: FlexibleBody) -> float:
    """Return the largest number of the modes and of the geometric stiffness, made dimensionless."""
    places = np.vstack([body.points, body.interface_position])
    size = np.ptp(places, axis=0).max() or np.float64(1.0)
    root = np.sqrt(body.m)
    parts = [body.Kg_W, body.Kg_A * size, body.Kg_F * (body.m * size), body.Kg_T * (body.m * size**2)]
    parts += [body.phi * root, body.shape * root, body.psi * (root * size)]
    parts += [] if body.T is None else [body.T * (root * size)]
    return max(float(np.abs(part).max(initial=0.0)) for part in parts)


def relative(a: np.ndarray | float, b: np.ndarray | float, floor: float = 0.0) -> float:
    """Return the largest difference of two arrays over the largest entry of the second, or over `floor`.

    Examples
    --------
    >>> relative(np.array([1.0, 2.0]), np.array([1.0, 4.0]))
    0.5
    """
    scale = max(np.abs(b).max(initial=0.0), floor, np.finfo(float).tiny)
    return float(np.abs(a - b).max(initial=0.0) / scale)


def _inertia_defect(J: np.ndarray) -> float:
    moments = _eigenvalues(J)
    return float(np.maximum(0.0, moments[2] - moments[0] - moments[1]) / max(moments[2], np.finfo(float).tiny))


def deflections(body: FlexibleBody) -> np.ndarray:
    """Return static responses (k, n) to accelerations, spins and interface loads of both signs, and combinations.

    All loads have the same magnitude: an acceleration a, ``a / size`` of spin, forces of ``m a`` and moments of
    ``m a size``, such that the largest displacement is the body's size.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=2)
    >>> float(np.linalg.norm(body.shape @ deflections(body).T, axis=1).max().round(3))
    10.0
    """
    size = np.ptp(body.points, axis=0).max()
    elastic = body.K > 0
    loads = [body.S, body.H / size, body.phi * body.m, body.psi * body.m * size]
    loads = np.concatenate([x.reshape(x.size // max(body.n, 1), body.n) for x in loads])
    answers = loads[:, elastic] / body.K[elastic] @ np.eye(body.n)[elastic]
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (TRIALS, len(answers)))
    answers = np.concatenate([answers, -answers, signs @ answers / len(answers)])
    reach = np.linalg.norm(body.shape @ answers.T, axis=1).max(initial=0.0)
    return answers * size / reach if reach > 0 else answers[:0]


def indefinite(M: np.ndarray) -> float:
    """Return how far the smallest eigenvalue of a mass matrix (6 + n, 6 + n), scaled, lies below zero.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> indefinite(mass_at(uniform_beam(modes=2), np.zeros(2)))
    0.0
    """
    scale = 1 / np.sqrt(np.maximum(np.diag(M), 1e-12 * np.abs(M).max()))
    return float(np.maximum(0.0, -_eigenvalues(M * scale * scale[:, None])[0]))


def _eigenvalues(A: np.ndarray) -> np.ndarray:
    """Return the eigenvalues of a symmetric matrix, ascending; NaN where its numbers overflow."""
    try:
        return np.linalg.eigvalsh(A)
    except np.linalg.LinAlgError:
        return np.full(len(A), np.nan)
