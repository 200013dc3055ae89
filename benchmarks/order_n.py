"""Does one evaluation of the accelerations cost O(n) in the bodies, and how does it compare with its peers?

    python benchmarks/order_n.py [--quick]

Prints six tables, each of medians of alternating rounds, CPU time of one thread, then one line of JSON:

- chains of 1 to 1000 bodies of 0 to 24 modes: `slope_bodies`, the worst exponent of the time per evaluation between
  the two longest chains, and `slope_modes`, that from 12 to 24 modes of the longest. These are of the least time of
  each chain, and the chains of an exponent alternate: other programs of the host only add to a time, and an exponent
  is of a difference of a few per cent;
- the dense way (dense_chain.py: composite bodies, inverse dynamics and LAPACK's Cholesky, all counted):
  `slope_dense`, its exponent between the two longest chains, and `crossover_bodies`, the shortest chain from which on
  order n is quicker; LAPACK's part alone is printed as well;
- rigid chains in Pinocchio and MuJoCo (peers_rigid.py): `rigid_vs_pinocchio_python`, `rigid_vs_mujoco`, both called
  from Python, as ours is, and `rigid_vs_pinocchio_cpp`, Pinocchio in a C++ loop against ours in a compiled loop:
  their time over ours, the smallest over the chains (null where the peer or a C++ compiler is missing);
- flexible mechanisms in Exudyn (peers_flexible.py): `flexible_vs_exudyn_1e3`, `flexible_vs_exudyn_1e5`, the same at
  equal accuracy, with our default method;
- ten links of 12 modes that swing for ten seconds (real_time.py): `realtime_factor`;
- a chain of 10,000 bodies of 6 modes: `chain_10000_bytes_per_body`, all arrays of an evaluation, and
  `chain_10000_vs_1000`, time per body against a chain of 1000.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator

import numpy as np
from chains import alternating, arguments, chain, compiled, from_python, medians
from dense_chain import dense
from peers_flexible import flexible
from peers_rigid import mujoco, pinocchio, pinocchio_compiled, pinocchio_library
from real_time import RTOL, ten_links, timed

from modalprep.compiler.by_address import Addressed

MODES = (0, 3, 6, 12, 24)
ROUNDS = 101  # of a least time
DENSE_MODES = 6
LONGEST_DENSE = 700  # speeds: the dense way takes seconds beyond


def slope(counts: tuple[int, ...], spent: list[float]) -> float:
    """Return the exponent of time over count, between the last two."""
    return float(np.log(spent[-1] / spent[-2]) / np.log(counts[-1] / counts[-2]))


def bodies_and_modes(quick: bool) -> dict[str, float]:
    """Print the time per body of flexible and rigid chains."""
    counts, rows = (1, 10, 50, 250) if quick else (1, 5, 10, 50, 100, 500, 1000), {}
    for modes in MODES:
        rows[modes] = least([(n, modes) for n in counts])
        each = ", ".join(f"{n}: {t / n:.3f}" for n, t in zip(counts, rows[modes], strict=True))
        print(f"{modes:2d} modes, us per body of chains {each}; slope {slope(counts, rows[modes]):.3f}", flush=True)
    return {
        "slope_bodies": round(max(slope(counts, row) for row in rows.values()), 3),
        "slope_modes": round(slope((12, 24), least([(counts[-1], 12), (counts[-1], 24)])), 3),
    }


def least(chains: list[tuple[int, int]]) -> list[float]:
    """Return the least time of an evaluation of chains, each (bodies, modes), over alternating rounds."""
    return [min(times) for times in alternating([compiled(arguments(chain(*each))) for each in chains], ROUNDS)]


def against_dense(quick: bool) -> dict[str, float]:
    """Print the dense time over ours."""
    counts = tuple(
        n for n in (1, 2, 3, 5, 10, 20, 50, 100) if n * (1 + DENSE_MODES) <= (360 if quick else LONGEST_DENSE)
    )
    rows = []
    for n in counts:
        given = arguments(chain(n, DENSE_MODES))
        rows.append(medians([compiled(given), *dense(given)], 7 if quick else 15))
    for n, (own, whole, solve) in zip(counts, rows, strict=True):
        print(f"{n} bodies of {DENSE_MODES} modes: dense / ours {whole / own:.1f}, LAPACK alone {solve / own:.2f}")
    slower = [n for n, (own, whole, _) in zip(counts, rows, strict=True) if own >= whole]
    return {
        "slope_dense": round(slope(counts, [row[1] for row in rows]), 3),
        "crossover_bodies": next(n for n in (*counts, None) if not slower or n is None or n > max(slower)),
    }


def rigid(quick: bool) -> dict[str, float | None]:
    """Print the peers' time over ours."""
    # the data of Pinocchio grow with the cube of n: 4 GB at 400
    counts = (1, 5, 10, 50, 100) if quick else (1, 5, 10, 50, 100, 200, 400)
    names = ("rigid_vs_pinocchio_python", "rigid_vs_mujoco", "rigid_vs_pinocchio_cpp")
    library, ratios = pinocchio_library(), {name: [] for name in names}
    if library is None:
        print("Pinocchio in C++: skipped, it needs g++, Eigen's headers and the wheel's")
    for n in counts:
        given = arguments(chain(n))
        made, drop = pinocchio_compiled(library, n) if library else (None, lambda: None)
        calls = [from_python(chain(n)), compiled(given), pinocchio(n), mujoco(n), made]
        spent = iter(medians([call for call in calls if call], 31 if quick else 101))
        python, loop, *peers = (next(spent) if call else None for call in calls)
        drop()
        for name, peer, own in zip(names, peers, (python, python, loop), strict=True):
            ratios[name] += [peer / own] if peer else []
        last = ", ".join(f"{name[9:]} {row[-1]:.2f}" for name, row in ratios.items() if row)
        print(f"rigid chain of {n}, time over ours: {last}", flush=True)
    return {name: round(min(row), 2) if row else None for name, row in ratios.items()}


def long_chain(quick: bool) -> dict[str, float]:
    """Print memory and time of chains of 10,000 bodies."""
    for modes in (0, DENSE_MODES):
        given, short = arguments(chain(10_000, modes)), arguments(chain(1000, modes))
        size = sum(array.nbytes for array in arrays(given)) / 10_000
        long, thousand = medians([compiled(given), compiled(short)], 5 if quick else 15)
        print(f"10,000 bodies of {modes} modes: {size:.0f} bytes each; {long / 10_000:.3f} us each in an evaluation, "
              f"{long / thousand / 10:.2f} times that of 1000", flush=True)  # fmt: skip
    return {"chain_10000_bytes_per_body": round(size), "chain_10000_vs_1000": round(long / thousand / 10, 3)}


def real_time(quick: bool) -> dict[str, float]:
    """Print how ten seconds of ten flexible bodies run."""
    factors = [timed(ten_links(), 10.0, rtol=RTOL)[0] for _ in range(1 if quick else 5)]
    return {"realtime_factor": round(float(np.median(factors)), 3)}


def arrays(given: object) -> Iterator[np.ndarray]:
    """Yield all arrays of nested tuples."""
    if isinstance(given, np.ndarray):
        yield given
    elif isinstance(given, tuple | Addressed):
        for part in given:
            yield from arrays(part)


def main() -> None:
    """Print the tables and the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="shorter chains, fewer rounds")
    quick, found = parser.parse_args().quick, {}
    for table in (bodies_and_modes, against_dense, rigid, flexible, real_time, long_chain):
        found |= table(quick)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
