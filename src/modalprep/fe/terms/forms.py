"""Forms of foundations, masses and loads.

They take the displacement alone, or on beams and shells also the rotation: u, v and w are first, middle and last.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from skfem.assembly import BilinearForm, LinearForm
from skfem.helpers import dot, grad


def along_axes(k: np.ndarray) -> BilinearForm:
    """``int sum_a k_a u_a v_a``, a = x, y, z."""

    def form(*f: Any) -> np.ndarray:
        return np.einsum("a,a...,a...->...", k, f[0], f[len(f) // 2])

    return BilinearForm(form)


def along_normal(k: float) -> BilinearForm:
    """``int k (u.n) (v.n)`` over faces."""

    def form(*f: Any) -> np.ndarray:
        return k * dot(f[0], f[-1].n) * dot(f[len(f) // 2], f[-1].n)

    return BilinearForm(form)


def across(k: float) -> BilinearForm:
    """``int k (u.v - (u.t) (v.t))`` over lines of tangents t."""

    def form(*f: Any) -> np.ndarray:
        u, v, t = f[0], f[len(f) // 2], f[-1].n
        return k * (dot(u, v) - dot(u, t) * dot(v, t))

    return BilinearForm(form)


def alike(k: float) -> BilinearForm:
    """``int k u.v``."""
    return along_axes(np.full(3, k))


def traction(t: np.ndarray) -> LinearForm:
    """``int t.v``."""

    def form(*f: Any) -> np.ndarray:
        return np.einsum("a,a...->...", t, f[0])

    return LinearForm(form)


def pressure(p: float) -> LinearForm:
    """``int p n.v`` over faces."""

    def form(*f: Any) -> np.ndarray:
        return p * dot(f[0], f[-1].n)

    return LinearForm(form)


def follower(p: float) -> BilinearForm:
    """``-int p v.d(n dA)``: the change ``n u_i,i - u_i,j n_i`` of area and normal of faces."""

    def form(*f: Any) -> np.ndarray:
        n, v = f[-1].n, f[len(f) // 2]
        return -p * (np.einsum("ii...", grad(f[0])) * dot(n, v) - np.einsum("i...,ij...,j...->...", n, grad(f[0]), v))

    return BilinearForm(form)
