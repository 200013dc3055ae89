"""Where decks and files of other programs lie; tests that need them are skipped where they are not."""

import os
from pathlib import Path

DATA = Path(os.environ.get("MODALPREP_DATA", Path(__file__).parents[2] / "shared" / "data"))
