"""Small Abaqus decks, and the displacements of such a deck on its own supports."""

import numpy as np

import modalprep as mp

E, NU, RHO = 2e11, 0.25, 7800.0
G = E / (2 * (1 + NU))
STEEL = "*MATERIAL, NAME=Steel\n*ELASTIC\n2e11, 0.25\n*DENSITY\n7800.\n"
NODES = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 2, 0, 0\n"
BEAM = NODES + "*ELEMENT, TYPE=B31, ELSET=b\n1, 1, 2\n2, 2, 3\n"
SECTION = "*BEAM SECTION, ELSET=b, MATERIAL=steel, SECTION=RECT\n.02, .05\n0, 1, 0\n"
QUAD = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 1, 1, 0\n4, 0, 1, 0\n*ELEMENT, TYPE=S4, ELSET=s\n1, 1, 2, 3, 4\n"
CUBE = (
    "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 1, 1, 0\n4, 0, 1, 0\n5, 0, 0, 1\n6, 1, 0, 1\n7, 1, 1, 1\n8, 0, 1, 1\n"
    "*ELEMENT, TYPE=C3D8, ELSET=c\n1, 1, 2, 3, 4, 5, 6, 7, 8\n*SOLID SECTION, ELSET=c, MATERIAL=steel\n"
)


def displacements(mesh, loads):
    """Displacements (n_nodes, 6) of a mesh on its own supports under forces {(number, component 0 to 5): value}."""
    held = {"held": mp.Support(set="boundary")}
    model = mp.assemble(mesh, {}, {"root": mp.Interface(kind="support")}, supports=held)
    C = model.C.toarray()
    keep = ~np.isin(model.free, model.interfaces[0].dofs)
    K, f = (C.T @ model.K.toarray() @ C)[np.ix_(keep, keep)], np.zeros(len(C))
    for (label, c), value in loads.items():
        f[model.dof[np.flatnonzero(mesh.labels == label)[0], c]] += value
    u = C[:, keep] @ np.linalg.solve(K, (C.T @ f)[keep])
    dof = model.dof[: len(mesh.points)]
    return np.where(dof >= 0, u[dof], 0.0)
