"""Ctrl-C where Python drops it, in finalisers and callbacks: it still ends the work, in one line."""

import signal
import threading
import time
import weakref
from contextlib import suppress
from pathlib import Path

import pytest

from modalprep.atomic import atomic_path
from modalprep.cli import main
from modalprep.cli.interrupt import PAUSE
from modalprep.pipeline import run

PATIENCE = 600 * PAUSE
JOB = str(Path(__file__).parents[2] / "pipelines" / "double-pendulum.toml")


def ctrl_c():
    signal.raise_signal(signal.SIGINT)


class Finalised:
    def __del__(self):
        ctrl_c()


def in_a_finaliser():
    Finalised()


def in_a_weak_reference():
    kept = threading.Event()
    watch = weakref.ref(kept, lambda _: ctrl_c())
    del kept
    assert watch() is None


def in_a_library_that_swallows_it():
    with suppress(BaseException):
        ctrl_c()


def in_a_library_that_fails_then():
    with suppress(BaseException):
        ctrl_c()
    raise RuntimeError("error return without exception set")


@pytest.fixture
def handled():
    """A shell that starts the tests in the background has them ignore Ctrl-C."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    assert signal.signal(signal.SIGINT, before) is signal.default_int_handler
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def interrupted(work, monkeypatch, capsys) -> bool:
    monkeypatch.setattr(run, "run_pipeline", lambda *given, **options: work())
    return (main(["run", JOB]), *capsys.readouterr()) == (130, "", "modalprep: interrupted\n")


@pytest.mark.usefixtures("handled")
@pytest.mark.parametrize(
    "where", [in_a_finaliser, in_a_weak_reference, in_a_library_that_swallows_it, in_a_library_that_fails_then]
)
def test_lost_interrupts_are_repeated(where, tmp_path, monkeypatch, capsys):
    """The work would go on for a minute, and then keep its file."""

    def work():
        with atomic_path(tmp_path / "a.h5") as temporary:
            temporary.write_text("half")
            where()
            time.sleep(PATIENCE)

    start = time.monotonic()
    assert interrupted(work, monkeypatch, capsys)
    assert time.monotonic() - start < PATIENCE / 2
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("handled")
def test_the_repetition_leaves_the_cleaning_up_alone(monkeypatch, capsys):
    cleaned = []

    def work():
        try:
            ctrl_c()
        finally:
            with suppress(OSError):
                raise OSError
            time.sleep(4 * PAUSE)
            cleaned.append(True)

    assert interrupted(work, monkeypatch, capsys)
    assert cleaned


@pytest.mark.usefixtures("handled")
def test_an_interrupt_that_was_lost_at_the_very_end(monkeypatch, capsys):
    assert interrupted(in_a_finaliser, monkeypatch, capsys)


@pytest.mark.usefixtures("handled")
def test_other_exceptions_of_finalisers_are_still_reported(monkeypatch):
    class Faulty:
        def __del__(self):
            raise ValueError("not silenced")

    reported = []
    monkeypatch.setattr("sys.unraisablehook", lambda lost: reported.append(str(lost.exc_value)))
    monkeypatch.setattr(run, "run_pipeline", lambda *given, **options: Faulty() and None)
    with suppress(AttributeError):  # of the outcome, which is None
        main(["run", JOB])
    assert reported == ["not silenced"]


def test_no_handler_outside_the_main_thread(monkeypatch, capsys):
    before, codes = signal.getsignal(signal.SIGINT), []
    thread = threading.Thread(target=lambda: codes.append(main(["--version"])))
    thread.start()
    thread.join()
    assert codes == [0]
    assert signal.getsignal(signal.SIGINT) is before
