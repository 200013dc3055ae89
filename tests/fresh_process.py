"""Code in a process of its own, forked from one that has imported `jit` only, so that it starts at once."""

import contextlib
import io
import multiprocessing
import os
import sys
from concurrent.futures import ProcessPoolExecutor

CONTEXT = multiprocessing.get_context("forkserver")
CONTEXT.set_forkserver_preload(["numba", "modalprep.compiler.jit"])


def printed(code, folder, *arguments, **environment):
    """Run code with the modules of a folder; return what it prints, raise what it raises."""
    with ProcessPoolExecutor(1, mp_context=CONTEXT) as pool:
        return pool.submit(_run, code, str(folder), arguments, environment).result()


def _run(code, folder, arguments, environment):
    from numba import config

    os.environ.update(environment)
    config.reload_config()
    sys.dont_write_bytecode = True  # a module that is written anew within a second would not be read again
    sys.path.insert(0, folder)
    sys.argv[1:] = arguments
    with contextlib.redirect_stdout(io.StringIO()) as text:
        exec(code, {"__name__": "fresh"})
    return text.getvalue()
