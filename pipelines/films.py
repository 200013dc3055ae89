"""Draw the films of the gallery and strips for print: ``python pipelines/films.py [NAME ...]``.

It runs the pipeline files, all if it is given no names, and keeps the time of each run in pipelines/times.json. A file
without a [film] table shows a mode of its body.
"""

import json
import resource
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from PIL import Image

HERE = Path(__file__).parent
PROGRAM = Path(sys.executable).with_name("modalprep")
TIMES = HERE / "times.json"
LARGEST = 1.5e6  # bytes
MODES = {"satellite": 5}  # the mode that is shown, if not the first
BODIES = {  # the file of the body that is shown, where it has another name
    "thrusted-beam": "thrusted-stage/thrusted-stage.h5",
    "two-beams": "two-beams/two-beams-outer.h5",
}


def main(names: list[str]) -> int:
    """Draw the films of these pipeline files; return the number of those that failed."""
    return sum(not _draw(name) for name in names or sorted(file.stem for file in HERE.glob("*.toml")))


def _draw(name: str) -> bool:
    file, target = HERE / f"{name}.toml", HERE / "pictures" / f"{name}.webp"
    with tempfile.TemporaryDirectory() as folder:
        if not (_timed(name, "run", file, "--quiet", "--output", folder) and _film(file, target, folder)):
            return False
    size = target.stat().st_size
    print(f"{name}: {size / 1000:.0f} kB{', too large' if size > LARGEST else ''}")
    return size <= LARGEST


def _film(file: Path, target: Path, folder: str) -> bool:
    """Draw the film and the strip of a run, or a mode."""
    name = file.stem
    if "film" not in tomllib.loads(file.read_text(encoding="utf-8")):
        modal, mode = f"{folder}/{BODIES.get(name, f'{name}/{name}.h5')}", MODES.get(name, 1)
        return _done("render", modal, "--animate", "--mode", mode, "-o", target)
    strip, picture = target.with_name(f"{name}-strip.webp"), f"{folder}/strip.png"
    film = ["film", file, "--output", folder, "-o"]
    if not (_done(*film, target) and _done(*film, picture, "--strip", "--positions", "5")):
        return False
    with Image.open(picture) as drawn:
        drawn.save(strip, quality=85, method=6)
    return True


def _timed(name: str, *words: object) -> bool:
    """Let the program work, and keep the time of its processor (s)."""
    begin = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = _done(*words)
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime
    times = json.loads(TIMES.read_text(encoding="utf-8")) if TIMES.exists() else {}
    TIMES.write_text(json.dumps(times | {name: round(spent, 1)}, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    return done


def _done(*words: object) -> bool:
    return subprocess.run([PROGRAM, *map(str, words)], check=False).returncode == 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
