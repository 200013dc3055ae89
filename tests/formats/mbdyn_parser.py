"""A reader of MBDyn's .fem files that follows the order in which MBDyn takes lines and numbers from the stream."""

from __future__ import annotations

import re

import numpy as np

REQUIRED = {1, 2, 5, 6, 7, 8, 9, 10}
LINE = 8191  # characters of a comment or marker that MBDyn's buffer holds


class Stream:
    """Lines and blank-separated words of one text, as a C++ stream hands them out."""

    def __init__(self, text):
        self.text, self.at = text, 0

    def line(self):
        end = self.text.index("\n", self.at)
        line, self.at = self.text[self.at : end], end + 1
        assert len(line) <= LINE
        return line

    def word(self):
        match = re.compile(r"\s*(\S+)").match(self.text, self.at)
        self.at = match.end()
        return match[1]

    def numbers(self, *shape):
        count = int(np.prod(shape))
        return np.array([float(self.word()) for _ in range(count)]).reshape(shape)


def read_mbdyn(path, last=19):
    """Return {group: value}; `last` is the highest group that the reader's version knows."""
    stream = Stream(path.read_text())
    groups, P, N = {}, 0, 0
    while stream.at < len(stream.text):
        line = stream.line()
        if line.startswith("** END OF FILE"):
            break
        if not line.startswith("** RECORD GROUP "):
            continue
        group = int(re.match(r"\*\* RECORD GROUP +(\d+)", line)[1])
        assert group == 1 or 1 in groups, "group 1 comes first"
        assert group not in groups, f"group {group} twice"
        assert group <= last, f"RECORD GROUP {group} unhandled"
        if group == 1:
            stream.line()
            stream.word()
            P, normal, attached, constraint, rejected = (int(stream.word()) for _ in range(5))
            N = normal + attached + constraint - rejected
        groups[group] = (P, N) if group == 1 else READ[group](stream, P, N)
    assert set(groups) >= REQUIRED
    return groups


def shapes(stream, P, N):
    found = []
    for _ in range(N):
        assert stream.line().startswith("**"), "one comment line before each mode"
        found.append(stream.numbers(P, 6))
        assert not stream.line()  # what is left of the last line
    return np.array(found)


def rigid(stream, P, N):
    return float(stream.word()), stream.numbers(3), stream.numbers(3, 3)


def stiffening(stream, P, N):
    return {int(stream.word()): stream.numbers(N, N) for _ in range(int(stream.word()))}


READ = {
    2: lambda stream, P, N: [stream.word() for _ in range(P)],
    5: lambda stream, P, N: stream.numbers(P),
    6: lambda stream, P, N: stream.numbers(P),
    7: lambda stream, P, N: stream.numbers(P),
    8: shapes,
    9: lambda stream, P, N: stream.numbers(N, N),
    10: lambda stream, P, N: stream.numbers(N, N),
    12: rigid,
    13: lambda stream, P, N: stream.numbers(N, N),
    14: lambda stream, P, N: stream.numbers(3, N),
    15: lambda stream, P, N: stream.numbers(3, N),
    16: lambda stream, P, N: stream.numbers(3, N, 3),  # row, mode, column
    17: lambda stream, P, N: stream.numbers(3, N, N),  # row, j, k
    18: lambda stream, P, N: stream.numbers(3, N, N, 3),  # row, j, k, column
    19: stiffening,
}
