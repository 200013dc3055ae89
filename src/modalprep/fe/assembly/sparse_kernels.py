"""Compiled loops that add blocks of elements to sparse matrices, and read these."""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_allocating


@compile_allocating
def column_numbers(lo, hi, dof, count, indptr, neighbour, column, row, indices):
    """Column numbers of the rows of nodes ``lo <= node < hi``: the DOFs of each neighbour; arrays as in `scatter`."""
    for node in range(lo, hi):
        for c in range(count[node]):
            for k in range(indptr[node], indptr[node + 1]):
                at = row[node, c] + column[k]
                first = dof[neighbour[k], 0]
                for d in range(count[neighbour[k]]):
                    indices[at + d] = first + d


@compile_allocating
def find_pairs(lo, hi, nodes, indptr, neighbour, pairs):
    """Set ``pairs (ne, nn, nn)`` of elements ``lo <= e < hi``: where in a graph node I of an element has its node J.

    Node I has its neighbours ``neighbour[indptr[I]:indptr[I + 1]]`` sorted.
    """
    for e in range(lo, hi):
        for i in range(nodes.shape[1]):
            start = indptr[nodes[e, i]]
            end = indptr[nodes[e, i] + 1]
            for j in range(nodes.shape[1]):
                pairs[e, i, j] = _find(neighbour, start, end, nodes[e, j])


@compile_allocating
def scatter(lo, hi, values, nodes, pairs, column, row, data):
    """Add element matrices ``values (ne, k, nl, nl)`` to rows of ``data (k, nnz)``, of the nodes ``lo <= node < hi``.

    `pairs` as `find_pairs` sets it; ``column`` holds, at the same place, where the neighbour's DOFs start within a
    row, and ``row[I, c]`` where row c of node I starts in `data`.
    """
    nn = nodes.shape[1]
    width = values.shape[2] // nn
    for e in range(nodes.shape[0]):
        for i in range(nn):
            node = nodes[e, i]
            if node < lo or node >= hi:
                continue
            for j in range(nn):
                place = column[pairs[e, i, j]]
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
def scatter_blocks(lo, hi, values, nodes, pairs, data):
    """Add ``values (ne, nn, p, nn, q)`` to the rows of the nodes ``lo <= node < hi`` of ``data (nnz, p, q)``."""
    nn = nodes.shape[1]
    for e in range(nodes.shape[0]):
        for i in range(nn):
            if lo <= nodes[e, i] < hi:
                for j in range(nn):
                    place = pairs[e, i, j]
                    for a in range(data.shape[1]):
                        for b in range(data.shape[2]):
                            data[place, a, b] += values[e, i, a, j, b]


@compile_allocating
def add_functions(lo, hi, indptr, neighbour, products, place, data):
    """Add the mass matrix to rows of nodes of `data`, from ``products (nnz, 10, 10)`` of `mass.NodalFunctions`.

    `indptr` and `neighbour` belong to the products, and `place` holds those of `data`, `column` and `row` (`scatter`).
    Exactly symmetric.
    """
    B = np.empty((10, 10))
    starts, others, column, row = place
    for i in range(lo, hi):
        for k in range(indptr[i], indptr[i + 1]):
            j = neighbour[k]
            back = _find(neighbour, indptr[j], indptr[j + 1], i)
            start = column[_find(others, starts[i], starts[i + 1], j)]
            for a in range(10):
                for b in range(10):
                    B[a, b] = (products[k, a, b] + products[back, b, a]) / 2
            for c in range(3):
                at = row[i, c] + start
                turned = row[i, 3 + c] + start
                data[at + c] += B[9, 9]
                for d in range(3):
                    data[at + 3 + d] += B[9, 3 * c + d]
                    data[turned + d] += B[3 * d + c, 9]
                    data[turned + 3 + d] += B[c, d] + B[3 + c, 3 + d] + B[6 + c, 6 + d]


@compile_allocating
def products(rows, indptr, indices, data, X, force):
    """Set ``force (len(rows), c, k)`` to some rows of ``A_k X``.

    ``data (nnz, k)`` of matrices of one CSR pattern, ``X (m, c)``. Of each row, one dense product of all matrices with
    what it touches of X.
    """
    longest = 0
    for row in rows:
        longest = max(longest, indptr[row + 1] - indptr[row])
    touched = np.empty((longest, X.shape[1]))
    for r in range(len(rows)):
        start = indptr[rows[r]]
        count = indptr[rows[r] + 1] - indptr[rows[r]]
        for p in range(count):
            touched[p] = X[indices[start + p]]
        np.dot(touched[:count].T, data[start : start + count], force[r])


@compile_allocating
def scatter_rows(rows, values, data):
    """Add ``values (k, m)`` to the `rows (k,)` of ``data (n, m)``, one after the other."""
    for k in range(len(rows)):
        for m in range(values.shape[1]):
            data[rows[k], m] += values[k, m]


@compile_allocating
def spread_scalar(lo, hi, scalar, indptr, column, row, data):
    """Add a matrix whose rows are nodes to the three displacement components of a matrix whose rows are DOFs."""
    for node in range(lo, hi):
        for k in range(indptr[node], indptr[node + 1]):
            for c in range(3):
                data[row[node, c] + column[k] + c] += scalar[k]


@compile_allocating
def diagonal(lo, hi, indptr, indices, data, out):
    """Diagonal ``out (n,)`` of a matrix with sorted indices."""
    for i in range(lo, hi):
        k = _find(indices, indptr[i], indptr[i + 1], i)
        if k < indptr[i + 1] and indices[k] == i:
            out[i] = data[k]


@compile_allocating
def _find(sorted_array, lo, hi, wanted):
    left = hi - lo
    while left > 1:  # without a branch that the processor could mispredict
        half = left >> 1
        lo += half * (sorted_array[lo + half] <= wanted)
        left -= half
    return lo
