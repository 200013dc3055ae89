"""Reduction of a model: Guyan, Craig-Bampton, truncation vectors, selection."""

from __future__ import annotations

from modalprep.lazy import lazy

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from modalprep.reduction.basis import Reduction as Reduction
    from modalprep.reduction.basis import Spans as Spans
    from modalprep.reduction.cyclic.modes import CyclicModes as CyclicModes
    from modalprep.reduction.cyclic.modes import cyclic_modes as cyclic_modes
    from modalprep.reduction.cyclic.ring import ring_algebra as ring_algebra
    from modalprep.reduction.damping import ComponentDamping as ComponentDamping
    from modalprep.reduction.damping import Rayleigh as Rayleigh
    from modalprep.reduction.damping import component_damping as component_damping
    from modalprep.reduction.damping import modal_damping as modal_damping
    from modalprep.reduction.damping import rayleigh as rayleigh
    from modalprep.reduction.derivatives import LeftOut as LeftOut
    from modalprep.reduction.error import ReductionError as ReductionError
    from modalprep.reduction.error import reduction_error as reduction_error
    from modalprep.reduction.free_interface_basis import free_interface as free_interface
    from modalprep.reduction.free_interface_basis import improved_guyan as improved_guyan
    from modalprep.reduction.loads import Load as Load
    from modalprep.reduction.loads import follower_stiffness as follower_stiffness
    from modalprep.reduction.loads import nodal_load as nodal_load
    from modalprep.reduction.prestress import LoadedModes as LoadedModes
    from modalprep.reduction.prestress import acceleration_load as acceleration_load
    from modalprep.reduction.prestress import buckling as buckling
    from modalprep.reduction.prestress import interface_load as interface_load
    from modalprep.reduction.prestress import prestressed_modes as prestressed_modes
    from modalprep.reduction.projected import ProjectedBasis as ProjectedBasis
    from modalprep.reduction.projected import projected_basis as projected_basis
    from modalprep.reduction.projected import reduced_body as reduced_body
    from modalprep.reduction.recoveries.convergence import Convergence as Convergence
    from modalprep.reduction.recoveries.convergence import recovery_convergence as recovery_convergence
    from modalprep.reduction.synthesis import SynthesisedModes as SynthesisedModes
    from modalprep.reduction.synthesis import synthesise as synthesise
    from modalprep.reduction.table import ModalBody as ModalBody
    from modalprep.reduction.table import ModeTable as ModeTable
else:  # type checkers would take any name
    __getattr__, __dir__, __all__ = lazy(__name__)
