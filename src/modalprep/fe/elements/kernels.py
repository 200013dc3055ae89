"""Compiled loops of assembly: gradients, elastic stiffness, and the sum of element matrices into CSR rows.

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

import numpy as np

from modalprep.jit import compile_allocating

THREADS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
AT_LEAST = 64  # elements or nodes of a thread: fewer take less time than to call it
_thread = local()


def in_threads(kernel: Callable, span: int | range, *arrays: object) -> None:
    """Run ``kernel(lo, hi, *arrays)`` over slices of a span, one per thread; kernels release the GIL.

    The threads of `ahead` run it alone.
    """
    span = range(span) if isinstance(span, int) else span
    slices = 1 if hasattr(_thread, "of_ahead") else min(THREADS, len(span) // AT_LEAST)
    if slices < 2:
        kernel(span.start, span.stop, *arrays)
        return
    cuts = np.linspace(span.start, span.stop, slices + 1).astype(np.int64).tolist()
    for job in [_pool().submit(kernel, *ends, *arrays) for ends in pairwise(cuts)]:
        job.result()


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(THREADS)


def ahead(function: Callable, items: Iterable) -> Iterator:
    """Yield ``function(item)`` in the order of `items`; threads evaluate the next ones in the meantime."""
    items = list(items)
    if len(items) == 1:
        yield function(items[0])
        return
    waiting: deque[Future] = deque()
    with ThreadPoolExecutor(THREADS, initializer=setattr, initargs=(_thread, "of_ahead", True)) as pool:
        for item in items:
            waiting.append(pool.submit(function, item))
            if len(waiting) > THREADS:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


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
                x, y, z = dx[e, q] * grad[e, q, i, 0], dx[e, q] * grad[e, q, i, 1], dx[e, q] * grad[e, q, i, 2]
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


@compile_allocating
def column_numbers(lo, hi, dof, count, indptr, neighbour, column, row, indices):
    """Column numbers of the rows of nodes ``lo <= node < hi``: the DOFs of each neighbour; arrays as in `scatter`."""
    for node in range(lo, hi):
        for c in range(count[node]):
            for k in range(indptr[node], indptr[node + 1]):
                at, first = row[node, c] + column[k], dof[neighbour[k], 0]
                for d in range(count[neighbour[k]]):
                    indices[at + d] = first + d


@compile_allocating
def scatter(lo, hi, values, nodes, indptr, neighbour, column, row, data):
    """Add element matrices ``values (ne, k, nl, nl)`` to rows of ``data (k, nnz)``, of the nodes ``lo <= node < hi``.

    Node I has its neighbours ``neighbour[indptr[I]:indptr[I + 1]]`` sorted; ``column`` holds, at the same place,
    where the neighbour's DOFs start within a row, and ``row[I, c]`` where row c of node I starts in `data`.
    """
    nn = nodes.shape[1]
    width = values.shape[2] // nn
    for e in range(nodes.shape[0]):
        for i in range(nn):
            node = nodes[e, i]
            if node < lo or node >= hi:
                continue
            for j in range(nn):
                place = column[find(neighbour, indptr[node], indptr[node + 1], nodes[e, j])]
                for k in range(values.shape[1]):
                    if width == 3:  # known lengths unroll
                        for a in range(3):
                            for b in range(3):
                                data[k, row[node, a] + place + b] += values[e, k, 3 * i + a, 3 * j + b]
                    else:
                        for a in range(6):
                            for b in range(6):
                                data[k, row[node, a] + place + b] += values[e, k, 6 * i + a, 6 * j + b]


@compile_allocating
def products(lo, hi, first, indptr, indices, data, X, force):
    """Add the rows `first + lo` ... of ``A_k X`` to ``force (rows, w, k, b)``.

    ``data (nnz, k)`` of matrices of one CSR pattern, ``X (m, w, b)``. Four entries of a row at a time, so that each
    sum is loaded and stored a quarter as often.
    """
    for r in range(lo, hi):
        start, end = indptr[first + r], indptr[first + r + 1]
        fours = start + (end - start) // 4 * 4
        for p in range(start, fours, 4):
            x0, x1, x2, x3 = X[indices[p]], X[indices[p + 1]], X[indices[p + 2]], X[indices[p + 3]]
            for w in range(X.shape[1]):
                for k in range(data.shape[1]):
                    a0, a1, a2, a3 = data[p, k], data[p + 1, k], data[p + 2, k], data[p + 3, k]
                    for b in range(X.shape[2]):
                        force[r, w, k, b] += a0 * x0[w, b] + a1 * x1[w, b] + a2 * x2[w, b] + a3 * x3[w, b]
        for p in range(fours, end):
            x = X[indices[p]]
            for w in range(X.shape[1]):
                for k in range(data.shape[1]):
                    for b in range(X.shape[2]):
                        force[r, w, k, b] += data[p, k] * x[w, b]


@compile_allocating
def scatter_rows(rows, values, data):
    """Add ``values (k, m)`` to the `rows (k,)` of ``data (n, m)``, one after the other."""
    for k in range(len(rows)):
        for m in range(values.shape[1]):
            data[rows[k], m] += values[k, m]


@compile_allocating
def scatter_scalar(lo, hi, values, nodes, indptr, neighbour, data):
    """Add ``values (ne, nn, nn, k)`` to k matrices whose rows are nodes, ``data (nnz, k)``."""
    nn = nodes.shape[1]
    for e in range(nodes.shape[0]):
        for i in range(nn):
            node = nodes[e, i]
            if lo <= node < hi:
                for j in range(nn):
                    place = find(neighbour, indptr[node], indptr[node + 1], nodes[e, j])
                    for k in range(data.shape[1]):
                        data[place, k] += values[e, i, j, k]


@compile_allocating
def spread_scalar(lo, hi, scalar, indptr, column, row, data):
    """Add a matrix whose rows are nodes to the three displacement components of a matrix whose rows are DOFs."""
    for node in range(lo, hi):
        for k in range(indptr[node], indptr[node + 1]):
            for c in range(3):
                data[row[node, c] + column[k] + c] += scalar[k]


@compile_allocating
def diagonal(lo, hi, indptr, neighbour, column, row, width, data, out):
    """Diagonal ``out (n_nodes, 6)`` of a matrix whose rows are DOFs, 0 where a node has none."""
    for node in range(lo, hi):
        if indptr[node] < indptr[node + 1]:
            place = column[find(neighbour, indptr[node], indptr[node + 1], node)]
            for a in range(width[node]):
                out[node, a] = data[row[node, a] + place + a]


@compile_allocating
def find(sorted_array, lo, hi, wanted):
    """Place of a number in ``sorted_array[lo:hi]``."""
    while hi - lo > 1:
        middle = (lo + hi) // 2
        if sorted_array[middle] <= wanted:
            lo = middle
        else:
            hi = middle
    return lo
