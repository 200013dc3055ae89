"""Does a chain of ten flexible bodies run faster than real time, and how much of it does recording take?

    python benchmarks/real_time.py [--quick]

Ten hinged aluminium links of 12 modes each swing for ten seconds, 100 outputs a second with all channels; the method is
the default one. The last line is JSON: `realtime_factor` (simulated time over wall time) at a relative tolerance of
1e-4, `realtime_factor_default` at the default one (--quick: of the first half second), `recording_share` (of the wall
time of the first), `us_per_sample` (its quickest block of samples).
"""

from __future__ import annotations

import argparse
import json
import time
from unittest.mock import patch

from integrators import chain, link

import modalprep as mp
from modalprep.multibody.results.record import Recorder

STEP = 0.01  # s between two outputs
RTOL = 1e-4


class TimedRecorder(Recorder):
    """A recorder that keeps how long each block of samples took."""

    blocks: list[tuple[float, int]]

    def add(self, times, states) -> None:
        """Record a block."""
        begin = time.perf_counter()
        super().add(times, states)
        self.blocks.append((time.perf_counter() - begin, len(times)))


def ten_links() -> mp.System:
    """Return the chain, its kernels compiled."""
    ten = chain(link(0.5, 12, 0.02), 10, angle=-1.0)
    mp.simulate(ten, t_end=0.001, output_step=0.001)
    return ten


def timed(system: mp.System, t_end: float, **options: float) -> tuple[float, float, float]:
    """Print how a run went; return its real-time factor, the share of recording, and the cost of a sample (us)."""
    TimedRecorder.blocks = []
    with patch("modalprep.multibody.simulate.Recorder", TimedRecorder):
        begin = time.perf_counter()
        run = mp.simulate(system, t_end=t_end, output_step=STEP, **options)
        wall = time.perf_counter() - begin
    share = sum(spent for spent, _ in TimedRecorder.blocks) / wall
    sample = 1e6 * min(spent / count for spent, count in TimedRecorder.blocks)
    evaluations = run.stats["evaluations"] / t_end
    print(
        f"{options or 'default'}: {t_end / wall:.3f} times real time, {evaluations:.0f} evaluations per second "
        f"simulated, recording {100 * share:.2g} % of the time, {sample:.0f} us per sample; {run.message}"
    )
    return t_end / wall, share, sample


def main() -> None:
    """Print the runs and the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="half a second instead of ten at the default tolerance")
    t_end, ten = 0.5 if parser.parse_args().quick else 10.0, ten_links()
    factor, share, sample = timed(ten, 10.0, rtol=RTOL)
    default, _, _ = timed(ten, t_end)
    print(json.dumps({
        "realtime_factor": round(factor, 3), "realtime_factor_default": round(default, 3),
        "recording_share": round(share, 5), "us_per_sample": round(sample, 1),
    }))  # fmt: skip


if __name__ == "__main__":
    main()
