"""Exudyn's own reduction of a model of solids on given modes."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from modalprep.formats.exudyn import surface_triangles


def reduced_by_exudyn(model, body):
    """Return Exudyn's interface of the model's matrices, in the modes of the body; skip without Exudyn."""
    fem = pytest.importorskip("exudyn.FEM")
    rows = model.dof[: len(model.points), :3].ravel()
    own = fem.FEMinterface()
    own.nodes = {"Position": np.array(model.points)}
    own.massMatrix, own.stiffnessMatrix = (csr_matrix(A[rows][:, rows]) for A in (model.M, model.K))
    own.modeBasis = {"matrix": body.shape.reshape(-1, body.n), "type": "NormalModes"}
    own.surface = [{"Name": "skin", "Trigs": surface_triangles(body.cells)}]
    return fem.ObjectFFRFreducedOrderInterface(own)
