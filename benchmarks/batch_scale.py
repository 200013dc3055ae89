"""What does a batch of ten thousand jobs cost its client, and is nothing lost when it is killed?

    python benchmarks/batch_scale.py [--quick] [--keep FOLDER]

A grid of 10,000 short runs of one mass on a spring (`--quick`: 200) goes from one client to four workers of a Dask
cluster of this machine. The client is killed twice, after three and six tenths of the jobs, and the same batch goes on
each time. The time of the client is that of its processor, all threads included, between the ends of two jobs, as the
mean of the first and of the last tenth of the jobs of the longest part. A cache of 36,000 entries (2,000) gets further
entries in turn with a plain write of the same bytes.

The last line is JSON: `planning_ms` and `resuming_ms` per job (the plan of an untouched and of a finished batch),
`client_ms_first` and `client_ms_last` per job, `memory_MB` (the client's largest), `lost` (jobs that were run again
though they had ended before a kill), `failed`, `cache_write_ms` (median), `cache_write_over_plain` (ratio of medians).
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import mean, median

import numpy as np

PIPELINE = """
[bodies.block]
mass = 1.0

[joints.slide]
type = "prismatic"
child = "block.root"
axis = [1, 0, 0]
stiffness = 50.0

[simulation]
t_end = 0.01

[grid]
"bodies.block.mass" = {masses}
"""
WORKERS = 4
PARTS = (0.3, 0.6, math.inf)  # of the jobs, at which the client is killed, and the end


def client(file: Path, address: str, moments: Path) -> None:
    """Run the batch, and write the time of the processor at the end of each job."""
    from modalprep.pipeline.batch.batch import run_batch
    from modalprep.pipeline.batch.dispatch import Where
    from modalprep.pipeline.batch.keep import Keeper
    from modalprep.pipeline.batch.plan import plan_batch
    from modalprep.pipeline.console import Reporter
    from modalprep.workers.scheduler import Scheduler

    ended = Keeper.ended
    lines = moments.open("w", buffering=1)

    def timed(keeper: Keeper, job: object, record: dict) -> None:
        ended(keeper, job, record)
        lines.write(f"{time.process_time()}\n")

    Keeper.ended = timed
    start = time.process_time()
    batch = plan_batch([str(file)], None)
    planned = time.process_time() - start
    run_batch(batch, Reporter(), Where(scheduler=Scheduler(address)), cache=None, limit=1.0)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    (moments.parent / "client.json").write_text(json.dumps({"planned": planned, "memory": peak}))


def one_part(file: Path, address: str, moments: Path, until: float) -> list[float]:
    """Run the batch until so many jobs of it have ended, and kill it; return the moments of the ends."""
    command = [sys.executable, __file__, "--client", file, address, moments]
    with subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL) as process:
        while process.poll() is None and len(done(file)) < until:
            time.sleep(1.0)
        if process.poll() is None:
            process.kill()
    return [float(line) for line in moments.read_text().split()]


def done(file: Path) -> set[str]:
    """Return the jobs with a manifest."""
    return {path.parent.name for path in (file.parent / "output").glob("*/manifest.json")}


def study(folder: Path, count: int) -> dict[str, float]:
    """Run the batch in three parts; return the figures."""
    from modalprep.pipeline.batch.plan import plan_batch

    file = folder / "spring.toml"
    file.write_text(PIPELINE.format(masses=[k + 0.25 for k in range(count)]))
    start = time.process_time()
    plan_batch([str(file)], None)
    planning = time.process_time() - start
    begun: dict[str, float] = {}
    parts, again = [], 0
    for number, part in enumerate(PARTS):
        with scheduler(folder) as address:
            moments = one_part(file, address, folder / f"moments-{number}.txt", part * count)
        again += sum(written(file, name) != begun[name] for name in begun)
        begun = {name: written(file, name) for name in done(file)}
        parts.append(moments)
    longest = max(parts, key=len)
    steps, tenth = np.diff(longest), max(1, len(longest) // 10)
    start = time.process_time()
    plan = plan_batch([str(file)], None)
    resuming = time.process_time() - start
    rows = json.loads((folder / "output" / "batch.json").read_text())
    said = json.loads((folder / "client.json").read_text())
    return {
        "planning_ms": 1e3 * planning / count,
        "resuming_ms": 1e3 * resuming / count,
        "client_ms_first": 1e3 * mean(steps[:tenth]),
        "client_ms_last": 1e3 * mean(steps[-tenth:]),
        "memory_MB": said["memory"],
        "lost": again + len(plan.waiting),
        "failed": rows["failed"],
    }


def written(file: Path, name: str) -> float:
    """Return when a manifest was written."""
    return (file.parent / "output" / name / "manifest.json").stat().st_mtime


class scheduler:
    """A scheduler and its workers, as processes."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "scheduler.json"

    def __enter__(self) -> str:
        """Start them; return the address."""
        self.file.unlink(missing_ok=True)
        own = ["--host", "127.0.0.1", "--no-dashboard"]
        named = ["--scheduler-file", str(self.file)]
        self.processes = [start("dask_scheduler", "--port", "0", *own, *named)]
        while not (self.file.is_file() and self.file.read_text().rstrip().endswith("}")):
            time.sleep(0.05)
        folder = str(self.file.parent / "dask")
        more = ["--nthreads", "1", "--no-nanny", "--local-directory", folder]
        self.processes += [start("dask_worker", *named, *own, *more) for _ in range(WORKERS)]
        return json.loads(self.file.read_text())["address"]

    def __exit__(self, *_: object) -> None:
        """End them."""
        for process in self.processes:
            process.kill()
            process.wait()


def start(name: str, *options: str) -> subprocess.Popen:
    """Start a program of Dask."""
    command = [sys.executable, "-m", f"distributed.cli.{name}", *options]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def cache(folder: Path, count: int) -> dict[str, float]:
    """Write entries among so many, in turn with a plain file of the same bytes."""
    from modalprep.pipeline.building.cache import Cache

    store = Cache(folder / "cache")
    for k in range(count):
        store.write(store.key("entry", k), {"x": np.arange(10.0)}, 0.0)
    ours, plain = [], []
    for k in range(count, count + 200):
        key = store.key("entry", k)
        begin = time.perf_counter()
        store.write(key, {"x": np.arange(10.0)}, 0.0)
        between = time.perf_counter()
        np.savez(folder / "plain.npz", x=np.arange(10.0))
        ours.append(between - begin)
        plain.append(time.perf_counter() - between)
    return {"cache_write_ms": 1e3 * median(ours), "cache_write_over_plain": median(ours) / median(plain)}


def main() -> None:
    """Print a line for each figure, and all as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--keep", type=Path, help="folder in which all files are left, to look at the page")
    parser.add_argument("--client", nargs=3, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.client:
        client(Path(given.client[0]), given.client[1], Path(given.client[2]))
        return
    folder = given.keep or Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    try:
        found = study(folder, 200 if given.quick else 10_000) | cache(folder, 2_000 if given.quick else 36_000)
    finally:
        if given.keep is None:
            shutil.rmtree(folder)
    for name, value in found.items():
        print(f"{name:24} {value:.3g}")
    print(json.dumps(found))


if __name__ == "__main__":
    main()
