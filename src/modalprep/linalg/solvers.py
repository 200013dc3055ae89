"""Names of the ways to factorise a matrix."""

from __future__ import annotations

from typing import Literal

Solver = Literal["auto", "in_memory", "single", "out_of_core", "superlu"]
