"""Libraries of FMUs on other machines, in C: a Windows DLL in Wine, aarch64 in QEMU, where these are installed."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from size import FULL

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.runtime import libraries
from modalprep.runtime.fmu import own_platform, write_fmu

pytest.importorskip("ziglang")
MINUTES = "minutes: its library is compiled and linked anew"
LOAD = Path(__file__).with_name("load.c")
STEPS, STEP, DRIVE = 20, 0.05, 500.0
OUTPUTS = ("hinge.angle", "arm.modal[1]", "energy.kinetic", "arm.tip.position[2]")


def zig(*options):
    subprocess.run([sys.executable, "-m", "ziglang", "cc", "-O1", *map(str, options)], check=True)


def arm(drive):
    motor = HingeElement(damping=40.0, drive=drive)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="arm", elements=motor)
    return mp.System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,), gravity=np.array([0, -9.81, 0]))


@pytest.fixture(scope="module")
def expected():
    """The end of two runs, the second with twice the torque."""
    found = []
    for drive in (DRIVE, 2 * DRIVE):
        run = mp.simulate(arm(drive), t_end=STEPS * STEP, rtol=1e-9)
        found += [run["hinge.angle"], run["arm.modal"][:, 0], run["energy.kinetic"], run["arm.tip.position"][:, 1]]
    return [history[-1] for history in found]


def ended(folder, platform, program, expected):
    """Run the program with an FMU that has the library of a platform; check the outputs at the end."""
    file = folder / "arm.fmu"
    model = write_fmu(arm(0.0), file, platforms=[platform], t_end=STEPS * STEP)
    with ZipFile(file) as archive:
        archive.extractall(folder / "unpacked")
    references = {each.name: str(each.reference) for each in model.variables}
    (library,) = (folder / "unpacked" / "binaries").glob("*/arm.*")
    where = Path("unpacked") / "resources"
    given = [os.path.relpath(library, folder), model.token, where.as_posix(), str(STEPS), str(STEP)]
    given += [references["hinge.drive_input"], str(DRIVE), *(references[name] for name in OUTPUTS)]
    done = subprocess.run([*program, *given], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    # the errors of steps at rtol 1e-8, over those of a run at 1e-9
    np.testing.assert_allclose(np.array(done.stdout.split(), dtype=float), expected, rtol=2e-6)


@pytest.mark.skipif(sys.platform != "linux", reason="loads a Linux library")
def test_a_program_in_c(tmp_path, expected):
    zig("-o", tmp_path / "load", LOAD, "-ldl")
    ended(tmp_path, own_platform(), [tmp_path / "load"], expected)


@pytest.mark.slow
@pytest.mark.skipif(not FULL, reason=MINUTES)
def test_windows(tmp_path, expected):
    wine = shutil.which("wine64") or shutil.which("wine64", path="/usr/lib/wine")
    if wine is None:
        pytest.skip("there is no Wine")
    zig("-target", "x86_64-windows-gnu", "-o", tmp_path / "load.exe", LOAD)
    ended(tmp_path, "windows-x86_64", [wine, tmp_path / "load.exe"], expected)


@pytest.mark.slow
@pytest.mark.skipif(not FULL, reason=MINUTES)
def test_aarch64(tmp_path, expected):
    """The objects of the library in a program without a loader, since QEMU has no C library of that machine."""
    if not (qemu := shutil.which("qemu-aarch64-static")):
        pytest.skip("there is no QEMU for aarch64")
    platform = libraries.PLATFORMS["linux-aarch64"]
    kernels = libraries._object(libraries.llvm_code("modal-open"), platform, "mp_", tmp_path)
    sources = [libraries.C / name for name in ("core.c", "directional.c", "events.c", "fmi2.c")]
    target = ["-target", "aarch64-linux-musl", "-static", "-DLINKED", "-DWITH_TANGENT"]
    zig(*target, "-o", tmp_path / "load", LOAD, *sources, kernels, "-lm")
    ended(tmp_path, "linux-aarch64", [qemu, tmp_path / "load"], expected)
