"""modalprep: finite-element meshes to flexible bodies for multibody dynamics, and their simulation.

The public names are loaded on first use, so that ``import modalprep`` costs nothing.
"""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from typing import Any

__version__ = "0.1.0"

_NAMES = {
    "fe.readers.read": "read_mesh",
    "fe.mesh.mesh": "Mesh",
    "fe.external.files": "read_matrices",
    "fe.properties.materials": "Material Orthotropic",
    "fe.properties.properties": "Beam Truss Ply Shell Solid",
    "fe.properties.points": "PointMass Spring",
    "fe.properties.sections": "beam_section",
    "fe.quality.quality": "check_mesh",
    "fe.generation.generate": "make_mesh",
    "fe.links.interface": "Connection Interface",
    "reduction.prestress": "buckling prestressed_modes interface_load acceleration_load",
    "fe.assembly.model": "FEModel",
    "fe.assembly.assemble": "assemble",
    "linalg.factor": "factorize",
    "linalg.modes": "lowest_modes",
    "fe.assembly.stress_recovery": "StressPoint stress_recovery",
    "reduction.craig_bampton": "craig_bampton guyan",
    "reduction.basis": "Reduction",
    "reduction.table": "ModeTable",
    "reduction.free_interface": "free_interface improved_guyan",
    "reduction.error": "reduction_error",
    "reduction.loads": "Load nodal_load",
    "reduction.synthesis": "synthesize",
    "reduction.projected": "projected_basis reduced_body",
    "reduction.damping": "component_damping modal_damping rayleigh",
    "body.build": "flexible_body",
    "body.flexible_body": "FlexibleBody",
    "body.rigid": "rigid_body",
    "body.checks": "check_body check_model CheckReport",
    "body.verify": "check_projection check_buckling",
    "body.mass": "mass_matrix",
    "body.frames": "reroot in_frame in_mean_axes in_principal_axes at_centre_of_mass",
    "formats.modalfile": "write_body read_body",
    "formats.resultfile": "write_result read_result write_csv read_csv",
    "formats.statespace": "write_state_space",
    "multibody.model.joint": "Joint",
    "multibody.model.system": "System",
    "multibody.model.time_function": "TimeFunction",
    "multibody.model.joint_element": "HingeElement",
    "multibody.model.loads": "PointForce DistributedForce AxialSpring Bushing Callback",
    "multibody.model.environment": "CentralGravity Orbit Dipole Conductor",
    "multibody.model.hydrodynamics": "ImmersedRod Water",
    "multibody.evaluation.impact": "Impact impact",
    "multibody.evaluation.feedback": "feedback",
    "multibody.model.constraints": "Closure Coupler",
    "multibody.model.events": "Event",
    "multibody.results.result": "Result",
    "multibody.simulate": "simulate",
    "multibody.model.deployment": "Deployment",
    "multibody.deploying.system": "DeployingSystem",
    "multibody.deploying.simulate": "simulate_deployment",
    "multibody.analysis.spin": "spin_modes",
    "multibody.analysis.equilibrium": "static_equilibrium",
    "multibody.analysis.linearise": "linearise",
    "multibody.analysis.state_space": "frequency_response",
    "multibody.analysis.system_modes": "system_modes",
    "multibody.analysis.inverse_dynamics": "inverse_dynamics hinge_forces",
    "multibody.free_body.free_flyer": "fly_free",
    "multibody.model.depletion": "Depletion ExpelledGas burn",
    "body.levels": "scaled",
    "body.stress": "StressModes",
    "body.frozen": "frozen_stiffness",
    "report.pictures.system_animation": "animate_system",
    "errors": "ModalprepError InputError OutputError MechanismError AccuracyError SimulationError RenderError",
    "fe.external.model": "model_from_matrices",
}
_HOME = {name: home for home, names in _NAMES.items() for name in names.split()}
__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"modalprep has no {name!r}; it has {', '.join(__all__)}")
    return getattr(import_module(f"modalprep.{_HOME[name]}"), name)
