"""A cantilever with recoveries, and the same model solved without modes."""

from dataclasses import replace

import numpy as np

import modalprep as mp
from modalprep.examples import beam_mesh, spinup_section

ELEMENTS, LENGTH, BETA = 6, 10.0, 2e-3
ENDS = {"root": mp.Interface(group="root", kind="node"), "tip": mp.Interface(group="tip", kind="node", boundary="free")}
WANTED = {
    "beam": mp.fe.Recover(kind="section_force", group="beam"),
    "wall": mp.fe.Recover(kind="reaction"),
    "middle": mp.fe.Recover(kind="acceleration", near=(LENGTH / 2, 0, 0)),
}


def cantilever(modes, truncation=(), wanted=WANTED, rho=3000.0, **options):
    """The spin-up beam of six elements: its model and its body."""
    mesh = beam_mesh(ELEMENTS, LENGTH)
    section = spinup_section()
    section = replace(section, material=replace(section.material, rho=rho))
    model = mp.assemble(mesh, {"beam": section}, ENDS)
    recovery = mp.fe.model_recovery(model, mesh, wanted)
    reduction = mp.craig_bampton(model, modes=modes, truncation=truncation)
    return model, mp.flexible_body(model, reduction, name="beam", recovery=recovery, **options)


def direct(model, f, base, tip):
    """Absolute displacements (n_dof,) and the reaction (6,) at the root under its acceleration and tip loads."""
    w = 2 * np.pi * f
    Z = (model.K * (1 + 1j * w * BETA) - w**2 * model.M).toarray()
    b, force = model.dof[0], np.zeros(len(Z), dtype=complex)
    force[model.dof[ELEMENTS]] = tip
    u = np.zeros(len(Z), dtype=complex)
    u[b] = -np.asarray(base) / w**2
    i = np.setdiff1d(np.arange(len(Z)), b)
    u[i] = np.linalg.solve(Z[np.ix_(i, i)], force[i] - Z[np.ix_(i, b)] @ u[b])
    return u, Z[b] @ u - force[b]
