"""Errors of modalprep; a message tells what is wrong, where, and what to do."""


class ModalprepError(Exception):
    """Base of all errors raised by modalprep; its text is a message for the user."""

    exit_code = 1


class InputError(ModalprepError, ValueError):
    """The input cannot be used as it is (exit code 2)."""

    exit_code = 2


class OutputError(InputError):
    """A file cannot be written: the disk is full or the folder not writable (exit code 2)."""


class MechanismError(InputError):
    """The clamped structure can still move without strain: a part is not connected."""


class AccuracyError(ModalprepError, RuntimeError):
    """A numerical result failed its check (exit code 1)."""


class SimulationError(ModalprepError, RuntimeError):
    """A simulation stopped before its end; the text names time, body and cause (exit code 1)."""


class ClusterError(ModalprepError, RuntimeError):
    """The workers of a cluster cannot be used, or have gone (exit code 1)."""


class RenderError(ModalprepError, RuntimeError):
    """VTK cannot draw on this machine (exit code 1)."""


class ModalprepWarning(UserWarning):
    """What a user should know of a result before trusting it; `notes.warn` issues it."""


class NotInstalledError(InputError, RenderError):
    """A library of an extra is not installed (exit code 2); runs go on without its pictures."""
