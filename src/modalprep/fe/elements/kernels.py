"""Compiled loops over elements: gradients, elastic stiffness, stress; and the threads that share them.

Arrays only. Each kernel works on a range of elements or of rows, so that threads share the work without a race
and every sum is taken in the order of the elements: the result does not depend on the number of threads.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from threading import local
from typing import Any

import numpy as np

from modalprep.compiler.jit import compile_allocating
from modalprep.linalg.blas import one_numpy_thread

THREADS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
AT_LEAST = 256  # elements or nodes of a thread: fewer take less time than to call it
KEPT = 31 * 2**20  # bytes
_thread = local()

# glibc gives freed memory back to the system until a program has freed an array of this size, which nobody has to
# touch for that: the page faults of fresh memory would take up to half of the time of small assemblies.
np.empty(KEPT, dtype=np.int8)


def in_threads(kernel: Callable, span: int | range, *arrays: object, least: int = AT_LEAST) -> None:
    """Run ``kernel(lo, hi, *arrays)`` over slices of a span, one per thread; kernels release the GIL.

    The calling thread runs the first slice. Those that are at work in `ahead` run all of them alone, and a single one
    runs what has fewer than twice `least` elements or nodes.
    """
    span = range(span) if isinstance(span, int) else span
    slices = 1 if hasattr(_thread, "works_alone") else min(THREADS, len(span) // least)
    if slices < 2:
        kernel(span.start, span.stop, *arrays)
        return
    cuts = np.linspace(span.start, span.stop, slices + 1).astype(np.int64).tolist()
    first, *others = pairwise(cuts)
    jobs = [_pool().submit(kernel, *ends, *arrays) for ends in others]
    kernel(*first, *arrays)
    for job in jobs:
        job.result()


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(THREADS)


if hasattr(os, "register_at_fork"):  # a forked process has none of its parent's threads
    os.register_at_fork(after_in_child=_pool.cache_clear)


def ahead(function: Callable, items: Iterable) -> Iterator:
    """Yield ``function(item)`` in the order of `items`; threads evaluate the next ones in the meantime.

    The calling thread evaluates one of the next itself where it would have to wait. NumPy's products use one thread.
    """
    items = deque(items)
    jobs = deque()
    if min(THREADS, len(items)) < 2:
        yield from map(function, items)
        return
    with one_numpy_thread(), ThreadPoolExecutor(THREADS - 1, initializer=_work_alone) as pool:
        _work_alone()
        try:
            while items or jobs:
                while items and len(jobs) <= THREADS:
                    jobs.append(_Job(pool, function, items.popleft()))
                while not jobs[0].result.done() and any(job.taken() for job in jobs):
                    pass
                yield jobs.popleft().result.result()
        finally:
            del _thread.works_alone


def _work_alone() -> None:
    _thread.works_alone = True


class _Job:
    """A call that a thread of a pool makes, or the thread that needs its result."""

    def __init__(self, pool: ThreadPoolExecutor, function: Callable, item: Any) -> None:
        self._function, self._item = function, item
        self.result: Future = pool.submit(function, item)

    def taken(self) -> bool:
        """Make the call here unless another thread has begun with it; whether it was made."""
        if not self.result.cancel():
            return False
        self.result = Future()
        try:
            self.result.set_result(self._function(self._item))
        except Exception as error:  # raised in its turn, so that the first item in error is told
            self.result.set_exception(error)
        return True


@compile_allocating
def gradients(lo, hi, x, dN, weight, grad, dx):
    """Global gradients ``grad (ne, nq, nf, 3)`` and measure ``dx (ne, nq)`` of isoparametric shapes.

    ``x (ne, nn, 3)``, ``dN (nq, nn, 3)`` on the reference cell. An inverted point has ``dx <= 0``.
    """
    J = np.empty((3, 3))
    inverse = np.empty((3, 3))
    for e in range(lo, hi):
        for q in range(dN.shape[0]):
            for a in range(3):
                for b in range(3):
                    s = 0.0
                    for i in range(x.shape[1]):
                        s += x[e, i, a] * dN[q, i, b]
                    J[a, b] = s
            det = invert(J, inverse)
            dx[e, q] = weight[q] * det
            for i in range(dN.shape[1]):
                for a in range(3):
                    grad[e, q, i, a] = (
                        dN[q, i, 0] * inverse[0, a] + dN[q, i, 1] * inverse[1, a] + dN[q, i, 2] * inverse[2, a]
                    )


@compile_allocating
def measures(lo, hi, x, dN, weight, dx):
    """Measure ``dx (ne, nq)`` of isoparametric shapes, as `gradients` gives it."""
    J = np.empty((3, 3))
    inverse = np.empty((3, 3))
    for e in range(lo, hi):
        for q in range(dN.shape[0]):
            J[:] = 0.0
            for i in range(x.shape[1]):
                for a in range(3):
                    for b in range(3):
                        J[a, b] += x[e, i, a] * dN[q, i, b]
            dx[e, q] = weight[q] * invert(J, inverse)


@compile_allocating
def invert(J, inverse):
    """Set the inverse of ``J (3, 3)``, where there is one, and return the determinant."""
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        for d in range(3):
            e, f = (d + 1) % 3, (d + 2) % 3
            inverse[d, a] = J[b, e] * J[c, f] - J[b, f] * J[c, e]
    det = J[0, 0] * inverse[0, 0] + J[0, 1] * inverse[1, 0] + J[0, 2] * inverse[2, 0]
    if det != 0.0:
        for a in range(3):
            for d in range(3):
                inverse[d, a] /= det
    return det


@compile_allocating
def elastic(lo, hi, grad, dx, lam, mu, K):
    """``K_(Ii)(Jj) = sum_q dx [lam N_I,i N_J,j + mu (N_I,j N_J,i + delta_ij N_I,k N_J,k)]``, exactly symmetric."""
    nq, nf = grad.shape[1], grad.shape[2]
    block = np.empty((3, 3))
    for e in range(lo, hi):
        for i in range(nf):
            for j in range(i + 1):
                block[:] = 0.0
                for q in range(nq):
                    for a in range(3):
                        g = grad[e, q, i, a] * dx[e, q]
                        for b in range(3):
                            block[a, b] += g * grad[e, q, j, b]
                trace = mu * (block[0, 0] + block[1, 1] + block[2, 2])
                for a in range(3):
                    for b in range(3):
                        value = lam * block[a, b] + mu * block[b, a]
                        if a == b:
                            value += trace
                        K[e, 3 * i + a, 3 * j + b] = value
                        K[e, 3 * j + b, 3 * i + a] = value
            for a in range(3):
                for b in range(a):
                    K[e, 3 * i + a, 3 * i + b] = K[e, 3 * i + b, 3 * i + a]


@compile_allocating
def directional_elastic(lo, hi, grad, dx, c, K):
    """``K_(Ia)(Jb) = sum_q dx c_akbl N_I,k N_J,l`` for moduli ``c (ne or 1, 3, 3, 3, 3)``, exactly symmetric."""
    nq, nf = grad.shape[1], grad.shape[2]
    block = np.empty((3, 3))
    for e in range(lo, hi):
        own = c[e if len(c) > 1 else 0]
        for i in range(nf):
            for j in range(i + 1):
                block[:] = 0.0
                for q in range(nq):
                    for k in range(3):
                        g = grad[e, q, i, k] * dx[e, q]
                        for m in range(3):
                            block[k, m] += g * grad[e, q, j, m]
                for a in range(3):
                    for b in range(3):
                        value = 0.0
                        for k in range(3):
                            for m in range(3):
                                value += own[a, k, b, m] * block[k, m]
                        K[e, 3 * i + a, 3 * j + b] = value
                        K[e, 3 * j + b, 3 * i + a] = value


@compile_allocating
def directional_stress(lo, hi, grad, u, c, sigma):
    """Cauchy stress as `isotropic_stress` gives it, for moduli ``c (ne or 1, 3, 3, 3, 3)``."""
    H = np.empty((3, 3, u.shape[3]))
    for e in range(lo, hi):
        own = c[e if len(c) > 1 else 0]
        for q in range(grad.shape[1]):
            H[:] = 0.0
            for i in range(grad.shape[2]):
                for a in range(3):
                    for b in range(3):
                        slope = grad[e, q, i, b]
                        for k in range(u.shape[3]):
                            H[a, b, k] += u[e, i, a, k] * slope
            for a in range(3):
                for b in range(3):
                    for k in range(u.shape[3]):
                        value = 0.0
                        for m in range(3):
                            for n in range(3):
                                value += own[a, b, m, n] * H[m, n, k]
                        sigma[e, q, a, b, k] = value


@compile_allocating
def isotropic_stress(lo, hi, grad, u, lam, mu, sigma):
    """Cauchy stress ``sigma (ne, nq, 3, 3, k)`` of k displacements ``u (ne, nf, 3, k)`` of shapes with gradients."""
    H = np.empty((3, 3, u.shape[3]))
    for e in range(lo, hi):
        for q in range(grad.shape[1]):
            H[:] = 0.0
            for i in range(grad.shape[2]):
                for a in range(3):
                    for b in range(3):
                        slope = grad[e, q, i, b]
                        for k in range(u.shape[3]):
                            H[a, b, k] += u[e, i, a, k] * slope
            for a in range(3):
                for b in range(3):
                    for k in range(u.shape[3]):
                        sigma[e, q, a, b, k] = mu * (H[a, b, k] + H[b, a, k])
                for k in range(u.shape[3]):
                    sigma[e, q, a, a, k] += lam * (H[0, 0, k] + H[1, 1, k] + H[2, 2, k])


@compile_allocating
def stress_stiffness(lo, hi, grad, sigma, dx, S):
    """``S (ne, nn, nn, k) = sum_q dx sigma_kl N_I,k N_J,l`` of k stresses, exactly symmetric."""
    flux = np.empty((3, S.shape[3]))
    for e in range(lo, hi):
        S[e] = 0.0
        for q in range(grad.shape[1]):
            s = sigma[e, q]
            for i in range(grad.shape[2]):
                x = dx[e, q] * grad[e, q, i, 0]
                y = dx[e, q] * grad[e, q, i, 1]
                z = dx[e, q] * grad[e, q, i, 2]
                for b in range(3):
                    for k in range(S.shape[3]):
                        flux[b, k] = x * s[0, b, k] + y * s[1, b, k] + z * s[2, b, k]
                for j in range(i + 1):
                    x, y, z = grad[e, q, j, 0], grad[e, q, j, 1], grad[e, q, j, 2]
                    for k in range(S.shape[3]):
                        S[e, i, j, k] += flux[0, k] * x + flux[1, k] * y + flux[2, k] * z
        for i in range(grad.shape[2]):
            for j in range(i):
                S[e, j, i] = S[e, i, j]


@compile_allocating
def quadratic(lo, hi, B, C, dx, K):
    """``K = sum_q dx B^T C B`` for strain rows ``B (ne, nq, ns, nl)``, moduli ``C (ne or 1, ns, ns)``; symmetric."""
    nq, ns, nl = B.shape[1], B.shape[2], B.shape[3]
    CB = np.empty((ns, nl))
    for e in range(lo, hi):
        for q in range(nq):
            for s in range(ns):
                CB[s] = 0.0
                for t in range(ns):
                    c = C[e if len(C) > 1 else 0, s, t] * dx[e, q]
                    if c != 0.0:
                        for j in range(nl):
                            CB[s, j] += c * B[e, q, t, j]
            for i in range(nl):
                for s in range(ns):
                    b = B[e, q, s, i]
                    if b != 0.0:
                        for j in range(i + 1):
                            K[e, i, j] += b * CB[s, j]
        for i in range(nl):
            for j in range(i):
                K[e, j, i] = K[e, i, j]
