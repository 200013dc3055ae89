"""A task whose jobs sleep, take memory, or end their process; for tests of workers."""

import os
import signal
import time


class Odd:
    """Jobs are (what, number): "ok", "sleep" for so long, "take" so many bytes, "kill" the process, "pid" of it."""

    own_process = True

    def run(self, job, stopped=lambda: False):
        what, number = job
        if what == "sleep":
            time.sleep(number)
        if what == "take":
            held = bytearray(b"x") * int(number)
            time.sleep(60 + len(held) * 0)
        if what == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        return what, os.getpid()

    def lost(self, job, cause):
        return "lost", cause

    def tidy(self, job, process):
        pass


class Shared(Odd):
    """The same in a thread of the worker, until somebody stops it."""

    own_process = False

    def run(self, job, stopped=lambda: False):
        what, number = job
        end = time.monotonic() + number
        while what == "sleep" and time.monotonic() < end and not stopped():
            time.sleep(0.01)
        return what, os.getpid()


class Once(Odd):
    """Jobs are (what, file): the first try leaves the file and dies."""

    def run(self, job, stopped=lambda: False):
        if not os.path.exists(job[1]):
            with open(job[1], "w"):
                os.kill(os.getpid(), signal.SIGKILL)
        return "done"


class Counted(Odd):
    """Counts how often it is sent."""

    sent = 0

    def __getstate__(self):
        self.sent += 1
        return {}
