"""Libraries that not every installation has, and the extra of the package that brings each of them."""

from __future__ import annotations

import platform
import sys
from importlib.util import find_spec

from modalprep.errors import NotInstalledError

EXTRA = {  # by the module that is imported
    "pyvista": "pictures",
    "gmsh": "mesh",
    "pypardiso": "fast",
    "pyyeti": "shock",
    "imageio_ffmpeg": "video",
    "pandas": "dataframe",
    "xarray": "xarray",
    "distributed": "cluster",
    "pyarrow": "study",
    "dask_jobqueue": "cluster",
    "control": "control",
    "ziglang": "fmu",
    "fmpy": "fmpy",
    "numba": "build",
}
WHEELS = {  # machines for which PyPI has one, of libraries that do not run everywhere
    "gmsh": ("linux x86_64", "darwin arm64", "darwin x86_64", "win32 AMD64"),
    "pypardiso": ("linux x86_64", "win32 AMD64"),
}
INSTEAD = {"gmsh": ": make the mesh on another machine, and give its file"}


def missing(module: str, what: str) -> str:
    """Return the sentence that names the extra which brings a library, empty where it is installed.

    Parameters
    ----------
    module : str
        One of `EXTRA`.
    what : str
        What needs it: the subject of the sentence.

    Examples
    --------
    >>> missing("gmsh", "a mesh") if find_spec("gmsh") is None else ""
    ''
    """
    if find_spec(module) is not None:
        return ""
    name = module.replace("_", "-")
    here = f"{sys.platform} {platform.machine()}"
    if here not in WHEELS.get(module, (here,)):
        return f"{what} needs {name}, which has no wheel for {here}{INSTEAD.get(module, '')}"
    return f"{what} needs {name}: pip install 'modalprep[{EXTRA[module]}]'"


def need(module: str, what: str) -> None:
    """Refuse what needs a library that is not installed.

    Raises
    ------
    NotInstalledError
        With the extra that brings the library.

    Examples
    --------
    >>> need("pandas", "a data frame") if find_spec("pandas") else None
    """
    if why := missing(module, what):
        raise NotInstalledError(why)
