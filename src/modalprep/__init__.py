"""modalprep: finite-element meshes to flexible bodies for multibody dynamics, and their simulation.

The public names are loaded on first use, so that ``import modalprep`` costs nothing.
"""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from typing import Any

__version__ = "0.1.0"

_HOME = {
    "read_mesh": "fe.read", "Mesh": "fe.mesh", "read_matrices": "fe.matrix_files",
    "Material": "fe.materials", "Orthotropic": "fe.materials", "Beam": "fe.properties", "Truss": "fe.properties",
    "Ply": "fe.properties", "Shell": "fe.properties", "Solid": "fe.properties", "PointMass": "fe.properties",
    "Spring": "fe.properties", "beam_section": "fe.sections", "check_mesh": "fe.quality", "make_mesh": "fe.generate",
    "Connection": "fe.interface", "buckling": "reduction.prestress", "prestressed_modes": "reduction.prestress",
    "interface_load": "reduction.prestress", "acceleration_load": "reduction.prestress",
    "Interface": "fe.interface", "FEModel": "fe.model", "assemble": "fe.assembly",
    "factorize": "linalg.factor", "lowest_modes": "linalg.modes",
    "StressPoint": "fe.stress", "stress_recovery": "fe.stress",
    "craig_bampton": "reduction.craig_bampton", "guyan": "reduction.craig_bampton",
    "Reduction": "reduction.basis", "ModeTable": "reduction.table", "free_interface": "reduction.free_interface",
    "improved_guyan": "reduction.free_interface", "reduction_error": "reduction.error",
    "Load": "reduction.loads", "nodal_load": "reduction.loads",
    "synthesize": "reduction.synthesis", "projected_basis": "reduction.projected",
    "reduced_body": "reduction.projected", "component_damping": "reduction.damping",
    "modal_damping": "reduction.damping", "rayleigh": "reduction.damping",
    "flexible_body": "body.build", "FlexibleBody": "body.flexible_body", "rigid_body": "body.rigid",
    "check_body": "body.checks", "check_model": "body.checks", "CheckReport": "body.checks",
    "check_projection": "body.verify", "check_buckling": "body.verify", "mass_matrix": "body.mass",
    "reroot": "body.frames", "in_frame": "body.frames", "in_mean_axes": "body.frames",
    "in_principal_axes": "body.frames", "at_centre_of_mass": "body.frames",
    "write_body": "formats.modalfile", "read_body": "formats.modalfile",
    "write_result": "formats.resultfile", "read_result": "formats.resultfile", "write_csv": "formats.resultfile",
    "write_state_space": "formats.statespace",
    "Joint": "multibody.joint", "System": "multibody.system", "TimeFunction": "multibody.timefunction",
    "HingeElement": "multibody.hinge", "PointForce": "multibody.loads", "DistributedForce": "multibody.loads",
    "AxialSpring": "multibody.loads", "Bushing": "multibody.loads", "CentralGravity": "multibody.orbit",
    "Orbit": "multibody.orbit", "Dipole": "multibody.orbit", "Conductor": "multibody.orbit",
    "ImmersedRod": "multibody.hydrodynamics", "Water": "multibody.hydrodynamics",
    "Impact": "multibody.impact", "impact": "multibody.impact",
    "Callback": "multibody.loads", "feedback": "multibody.feedback",
    "Closure": "multibody.closures", "Coupler": "multibody.closures",
    "Event": "multibody.events", "Result": "multibody.result", "simulate": "multibody.simulate",
    "Deployment": "multibody.deployment", "DeployingSystem": "multibody.deployment_system",
    "simulate_deployment": "multibody.deploying", "spin_modes": "multibody.spin",
    "static_equilibrium": "multibody.equilibrium", "linearise": "multibody.linearise",
    "frequency_response": "multibody.state_space", "system_modes": "multibody.modes",
    "inverse_dynamics": "multibody.inverse", "hinge_forces": "multibody.inverse", "fly_free": "multibody.free_flyer",
    "Depletion": "multibody.depletion", "ExpelledGas": "multibody.depletion", "burn": "multibody.depletion",
    "scaled": "body.levels", "StressModes": "body.stress",
    "frozen_stiffness": "body.frozen", "read_csv": "formats.resultfile", "animate_system": "report.system_animation",
    "ModalprepError": "errors", "InputError": "errors", "OutputError": "errors", "MechanismError": "errors",
    "AccuracyError": "errors", "SimulationError": "errors", "RenderError": "errors",
}  # fmt: skip
__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"modalprep has no {name!r}; it has {', '.join(__all__)}")
    return getattr(import_module(f"modalprep.{_HOME[name]}"), name)
