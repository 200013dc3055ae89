"""Charts of matplotlib: their style, histories, effective masses, and their files.

Matplotlib lists the properties of each of its artists in docstrings and signatures, and imports axes in three
dimensions, which takes half of its import. Commands, in which nobody reads the one or draws the other, go without: this
package is imported before those parts of matplotlib.
"""

import sys
import warnings
from importlib import import_module
from types import ModuleType

if "modalprep.cli" in sys.modules and "matplotlib.artist" not in sys.modules:
    from matplotlib import artist

    artist.kwdoc = lambda _: ""
    setattr(artist.Artist, "_update_set_signature_and_docstring", classmethod(lambda _: None))  # noqa: B010
    with warnings.catch_warnings(action="ignore"):  # that there are none in three dimensions
        modules: dict[str, ModuleType | None] = sys.modules  # pyright: ignore[reportAssignmentType]  # None: no such
        modules["mpl_toolkits.mplot3d"] = None
        import_module("matplotlib.projections")
    del sys.modules["mpl_toolkits.mplot3d"]
