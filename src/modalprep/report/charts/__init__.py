"""Charts of matplotlib: their style, histories, effective masses, and their files.

Matplotlib lists the properties of each of its artists in docstrings and signatures, which takes half of its import.
Commands, in which nobody reads them, go without: this package is imported before those parts of matplotlib.
"""

import sys

if "modalprep.cli" in sys.modules and "matplotlib.artist" not in sys.modules:
    from matplotlib import artist

    artist.kwdoc = lambda _: ""
    artist.Artist._update_set_signature_and_docstring = classmethod(lambda _: None)
