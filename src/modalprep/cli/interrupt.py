"""Reliable Ctrl-C: Python drops an interrupt that arrives in a finaliser or in a callback of a library."""

from __future__ import annotations

import signal
import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

PAUSE = 0.1  # s, after which an interrupt without effect is repeated


@contextmanager
def repeated_interrupts() -> Iterator[None]:
    """Repeat an interrupt until it ends the block, which then raises KeyboardInterrupt whatever else happened.

    From the interrupt on nothing warns.

    It has no effect in a thread, or where SIGINT is ignored or has another handler.

    Raises
    ------
    KeyboardInterrupt
        When the user interrupted the block at any time.
    """
    if not _can_handle():
        yield
        return
    arrived = over = False

    def interrupt(number: int, frame: Any) -> None:
        nonlocal arrived
        arrived = True
        warnings.simplefilter("ignore")  # of libraries whose import is cut short
        signal.setitimer(signal.ITIMER_REAL, PAUSE)
        if not over and (number == signal.SIGINT or not _interrupt_in_progress()):
            raise KeyboardInterrupt

    def unraisable(lost: Any) -> None:
        if not issubclass(lost.exc_type, KeyboardInterrupt):
            hook(lost)

    hook, sys.unraisablehook = sys.unraisablehook, unraisable
    handlers = {number: signal.signal(number, interrupt) for number in (signal.SIGALRM, signal.SIGINT)}
    try:
        with warnings.catch_warnings():
            yield
    finally:
        over = True
        signal.setitimer(signal.ITIMER_REAL, 0)
        for number, handler in handlers.items():
            signal.signal(number, handler)
        sys.unraisablehook = hook
        if arrived:
            raise KeyboardInterrupt


def _can_handle() -> bool:
    """Whether SIGINT arrives here and there is a timer to repeat it (Windows has none)."""
    here = threading.current_thread() is threading.main_thread() and hasattr(signal, "setitimer")
    return here and signal.getsignal(signal.SIGINT) is signal.default_int_handler


def _interrupt_in_progress() -> bool:
    """Whether an interrupt already ends the program: another one would stop the removal of temporary files."""
    error = sys.exception()
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None
