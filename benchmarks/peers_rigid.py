"""Rigid chains in Pinocchio and MuJoCo: the same accelerations as chains.py, to be timed beside them.

Both are general: Pinocchio's ABA serves every joint of its library and keeps placements, velocities and inertias of
all bodies for other algorithms; MuJoCo's mj_forward does positions, velocities, its sparse mass matrix and its
factor, sensors and (here empty) constraints.
"""

from __future__ import annotations

import ctypes
import hashlib
import shutil
import subprocess
import sysconfig
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from chains import LINK

CENTRE = np.array([0.5, 0, 0])
INERTIA = np.array([0.00125, 0.084, 0.084])
SOURCE = Path(__file__).with_name("pinocchio_loop.cpp")
INCLUDES = (Path(sysconfig.get_path("purelib")) / "cmeel.prefix/include", Path("/usr/include/eigen3"))


def _pinocchio_model(count: int):
    """Return the library and its model of a chain; None where it is not installed."""
    try:
        import pinocchio as pin
    except ImportError:
        return None
    model, parent = pin.Model(), 0
    for i in range(count):
        place = pin.SE3(np.eye(3), np.array([0.0 if i == 0 else 1.0, 0, 0]))
        joint = pin.JointModelRZ() if i % 2 == 0 else pin.JointModelRY()
        parent = model.addJoint(parent, joint, place, f"j{i}")
        model.appendBodyToJoint(parent, pin.Inertia(LINK.m, CENTRE, np.diag(INERTIA)), pin.SE3.Identity())
    return pin, model


def pinocchio(count: int) -> Callable[[int], None] | None:
    """Return a call of Pinocchio's ABA from Python, a number of times; None where it is not installed."""
    if (found := _pinocchio_model(count)) is None:
        return None
    pin, model = found
    data, rng, aba = model.createData(), np.random.default_rng(0), pin.aba
    q, v, tau = 0.1 * rng.standard_normal(count), 0.1 * rng.standard_normal(count), np.zeros(count)

    def call(times: int) -> None:
        for _ in range(times):
            aba(model, data, q, v, tau)

    return call


def pinocchio_derivatives(count: int) -> Callable[[], object] | None:
    """Return a call of Pinocchio's derivatives of the inverse dynamics; None where it is not installed."""
    if (found := _pinocchio_model(count)) is None:
        return None
    pin, model = found
    data, (q, v, a) = model.createData(), 0.1 * np.random.default_rng(0).standard_normal((3, count))
    return lambda: pin.computeRNEADerivatives(model, data, q, v, a)


def mujoco(count: int) -> Callable[[int], None] | None:
    """Return the same for MuJoCo's mj_forward without contacts and constraints."""
    try:
        import mujoco as mj
    except ImportError:
        return None
    spec = mj.MjSpec()
    spec.option.disableflags = mj.mjtDisableBit.mjDSBL_CONTACT | mj.mjtDisableBit.mjDSBL_CONSTRAINT
    body = spec.worldbody
    for i in range(count):
        body = body.add_body(pos=[0.0 if i == 0 else 1.0, 0, 0])
        body.mass, body.ipos, body.inertia, body.explicitinertial = LINK.m, CENTRE, INERTIA, True
        body.add_joint(type=mj.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1] if i % 2 == 0 else [0, 1, 0])
    model = spec.compile()
    data, rng, forward = mj.MjData(model), np.random.default_rng(0), mj.mj_forward
    data.qpos[:], data.qvel[:] = 0.1 * rng.standard_normal((2, count))

    def call(times: int) -> None:
        for _ in range(times):
            forward(model, data)

    return call


def pinocchio_library() -> ctypes.CDLL | None:
    """Compile Pinocchio's ABA in a loop; None without compiler or Eigen."""
    library = compiled_loop(SOURCE)
    if library is not None:
        library.make_chain.restype = ctypes.c_void_p
        library.make_chain.argtypes = [ctypes.c_int, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p]
        library.repeat.argtypes, library.drop.argtypes = [ctypes.c_void_p, ctypes.c_int], [ctypes.c_void_p]
    return library


def compiled_loop(source: Path) -> ctypes.CDLL | None:
    """Compile a loop around Pinocchio for this machine, from the wheel's headers; None without compiler or Eigen."""
    compiler = shutil.which("g++")
    if compiler is None or not all(
        (folder / name).is_dir() for folder, name in zip(INCLUDES, ("pinocchio", "Eigen"), strict=True)
    ):
        return None
    options = ["-O3", "-DNDEBUG", "-march=native", "-std=c++17", "-fPIC", "-shared", "-fvisibility=hidden", "-w"]
    options += ["-DBOOST_MPL_LIMIT_LIST_SIZE=30", "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS"]  # as its CMake files set
    options += ["-Wl,-Bsymbolic", *(f"-I{folder}" for folder in INCLUDES)]
    stamp = hashlib.sha256(source.read_bytes() + repr(options).encode()).hexdigest()[:12]
    target = Path(tempfile.gettempdir()) / f"{source.stem}-{stamp}.so"
    if not target.exists():
        print("compiling Pinocchio's loop, once: a minute or two", flush=True)
        fresh = target.with_suffix(".part")
        done = subprocess.run([compiler, *options, str(source), "-o", str(fresh)], capture_output=True, text=True)
        if done.returncode:
            print(f"Pinocchio's loop does not compile: {done.stderr.splitlines()[:1]}")
            return None
        fresh.rename(target)
    return ctypes.CDLL(str(target))


def pinocchio_compiled(library: ctypes.CDLL, count: int) -> tuple[Callable[[int], None], Callable[[], None]]:
    """Return a call of the compiled loop, and one that frees its chain."""
    made = library.make_chain(count, LINK.m, CENTRE.ctypes.data, INERTIA.ctypes.data)
    return lambda times: library.repeat(made, times), lambda: library.drop(made)
