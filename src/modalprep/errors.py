"""Errors of modalprep: what arrived, where, and what to do about it, in one sentence."""


class ModalprepError(Exception):
    """Base of every error raised on purpose; its text is one sentence for the user."""

    exit_code = 1


class InputError(ModalprepError, ValueError):
    """The input cannot be used as it is (exit code 2)."""

    exit_code = 2


class OutputError(InputError):
    """A file cannot be written: the disk is full, or the folder closed (exit code 2)."""


class MechanismError(InputError):
    """The clamped structure can still move without strain: something is not attached."""


class AccuracyError(ModalprepError, RuntimeError):
    """A numerical result did not pass its own check (exit code 1)."""


class SimulationError(ModalprepError, RuntimeError):
    """A simulation stopped before its end; the text names time, body and cause (exit code 1)."""


class RenderError(ModalprepError, RuntimeError):
    """VTK cannot draw on this machine (exit code 1)."""
