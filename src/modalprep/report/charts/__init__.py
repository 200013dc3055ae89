"""Charts of matplotlib: their style, histories, effective masses, and their files.

Matplotlib lists the properties of each of its artists in its docstrings, which takes a third of its import. Commands,
in which nobody reads them, go without: this package is imported before those parts of matplotlib.
"""

import sys

if "modalprep.cli" in sys.modules and "matplotlib.artist" not in sys.modules:
    from matplotlib import artist

    artist.kwdoc = lambda _: ""
