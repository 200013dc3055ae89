"""Finite elements: meshes, properties, families, interfaces; the only home of scikit-fem, meshio, gmsh."""

from __future__ import annotations

from modalprep.lazy import lazy

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from modalprep.fe.assembly.bases import facet_bases as facet_bases
    from modalprep.fe.assembly.bases import group_bases as group_bases
    from modalprep.fe.assembly.model import AddedTerm as AddedTerm
    from modalprep.fe.assembly.model import FEModel as FEModel
    from modalprep.fe.assembly.stress_recovery import Stress as Stress
    from modalprep.fe.assembly.stress_recovery import StressPoint as StressPoint
    from modalprep.fe.assembly.stress_recovery import StressRecovery as StressRecovery
    from modalprep.fe.assembly.stress_recovery import stress_recovery as stress_recovery
    from modalprep.fe.external.files import Matrices as Matrices
    from modalprep.fe.external.files import read_matrices as read_matrices
    from modalprep.fe.external.model import model_from_matrices as model_from_matrices
    from modalprep.fe.external.scikit_fem import SkfemModel as SkfemModel
    from modalprep.fe.external.scikit_fem import model_from_skfem as model_from_skfem
    from modalprep.fe.external.scikit_fem import to_skfem as to_skfem
    from modalprep.fe.links.interface import InterfaceFrame as InterfaceFrame
    from modalprep.fe.links.ring import make_ring as make_ring
    from modalprep.fe.mesh.analysis import AnalysisCase as AnalysisCase
    from modalprep.fe.mesh.analysis import LoadSet as LoadSet
    from modalprep.fe.mesh.cyclic import CyclicSymmetry as CyclicSymmetry
    from modalprep.fe.mesh.mesh import Equation as Equation
    from modalprep.fe.mesh.mesh import Link as Link
    from modalprep.fe.mesh.mesh import MatrixElement as MatrixElement
    from modalprep.fe.mesh.mesh import Mesh as Mesh
    from modalprep.fe.mesh.mesh import SupportSet as SupportSet
    from modalprep.fe.properties.materials import Anisotropic as Anisotropic
    from modalprep.fe.properties.materials import Orthotropic as Orthotropic
    from modalprep.fe.properties.materials import Orthotropic3D as Orthotropic3D
    from modalprep.fe.properties.properties import Ply as Ply
    from modalprep.fe.properties.properties import Property as Property
    from modalprep.fe.properties.sections import beam_section as beam_section
    from modalprep.fe.quality.findings import Finding as Finding
    from modalprep.fe.quality.findings import Statistics as Statistics
    from modalprep.fe.quality.quality import Quality as Quality
    from modalprep.fe.recovery.fields import Fields as Fields
    from modalprep.fe.recovery.fields import Quantity as Quantity
    from modalprep.fe.recovery.recover import ModelRecovery as ModelRecovery
    from modalprep.fe.recovery.recover import Recover as Recover
    from modalprep.fe.recovery.recover import model_recovery as model_recovery
    from modalprep.fe.sensitivity.parameters import ModelParameter as ModelParameter
    from modalprep.fe.terms.term import Term as Term
else:  # type checkers would take any name
    __getattr__, __dir__, __all__ = lazy(__name__)
