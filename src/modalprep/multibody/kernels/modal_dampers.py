"""Viscous dampers that couple the modes of a body: what its damping matrix has off the diagonal (theory 4.11).

`modal` as in modal_interfaces.py; C are the rows `Modal.dampers`. Bodies whose modes have damping of their own alone
have no row.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, four, get_lanes, put_lanes


@compile_inline
def add_damper_forces(modal, model, i):
    """Add ``C q'`` to the modal bias force of link i's body."""
    if model.links[i].dampers >= 0:
        _add_damper_forces(modal, model, i)


@compile_kernel
def _add_damper_forces(modal, model, i):
    C = model.modal.dampers[model.links[i].dampers]
    n, s = model.links[i].modes, model.links[i].slot
    for b in range(0, n, WIDTH):
        force = four(0.0)
        for a in range(n):
            force = force + modal.qd[s, a] * get_lanes(C[a], b)
        put_lanes(modal.b_f[s], b, get_lanes(modal.b_f[s], b) + force)


@compile_inline
def add_dampers_to_mass(modal, model, i, c1):
    """Add ``c1 C`` of an implicit step to the upper half of M_ff of link i's body."""
    if model.links[i].dampers >= 0 and c1 != 0.0:
        _add_dampers_to_mass(modal, model, i, c1)


@compile_kernel
def _add_dampers_to_mass(modal, model, i, c1):
    C = model.modal.dampers[model.links[i].dampers]
    n, M_ff = model.links[i].modes, modal.M_ff[model.links[i].slot]
    for a in range(n):
        for b in range(a & -WIDTH, n, WIDTH):
            put_lanes(M_ff[a], b, get_lanes(M_ff[a], b) + c1 * get_lanes(C[a], b))


@compile_inline
def subtract_damper_forces(modal, model, factor, rates, out):
    """Subtract ``factor C rates`` from ``out``, both (nu,) of all speeds; `modal` is that of the data or None."""
    if modal is not None:
        if len(model.modal.dampers) > 0:
            _subtract_damper_forces(model, factor, rates, out)


@compile_kernel
def _subtract_damper_forces(model, factor, rates, out):
    for i in range(len(model.links)):
        if model.links[i].dampers >= 0:
            C = model.modal.dampers[model.links[i].dampers]
            u = model.links[i].uq
            for a in range(model.links[i].modes):
                total = 0.0
                for b in range(model.links[i].modes):
                    total += C[a, b] * rates[u + b]
                out[u + a] -= factor * total


@compile_inline
def damper_power(modal, model, i):
    """Return ``q' C q'`` of link i's body: what its dampers take (W) beside the damping of each mode for itself."""
    total = 0.0
    if modal is not None:
        if model.links[i].dampers >= 0:
            C = model.modal.dampers[model.links[i].dampers]
            rates = modal.qd[model.links[i].slot]
            for a in range(model.links[i].modes):
                for b in range(model.links[i].modes):
                    total += rates[a] * C[a, b] * rates[b]
    return total
