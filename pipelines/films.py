"""Draw the films of the gallery: ``python pipelines/films.py [NAME ...]``, into pipelines/pictures/NAME.webp.

Without names it simulates and draws every pipeline file that has a [film] table.
"""

import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

HERE = Path(__file__).parent
PROGRAM = Path(sys.executable).with_name("modalprep")
LARGEST = 1.5e6  # bytes


def main(names: list[str]) -> int:
    """Draw the films of these pipeline files; return the number of those that failed."""
    files = [HERE / f"{name}.toml" for name in names] or [file for file in sorted(HERE.glob("*.toml")) if _films(file)]
    return sum(not _draw(file) for file in files)


def _films(file: Path) -> bool:
    return "film" in tomllib.loads(file.read_text(encoding="utf-8"))


def _draw(file: Path) -> bool:
    target = HERE / "pictures" / f"{file.stem}.webp"
    with tempfile.TemporaryDirectory() as folder:
        for command in (["simulate", str(file), "--quiet"], ["film", str(file), "-o", str(target)]):
            done = subprocess.run([PROGRAM, *command, "--output", folder], check=False)
            if done.returncode:
                return False
    size = target.stat().st_size
    print(f"{target.name}: {size / 1000:.0f} kB{', too large' if size > LARGEST else ''}")
    return size <= LARGEST


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
