"""Multibody systems: joints, equations of motion, simulation."""

from __future__ import annotations

from modalprep.lazy import lazy

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from modalprep.multibody.analysis.equilibrium import Equilibrium as Equilibrium
    from modalprep.multibody.analysis.inverse_dynamics import InverseDynamics as InverseDynamics
    from modalprep.multibody.analysis.inverse_dynamics import hinge_forces as hinge_forces
    from modalprep.multibody.analysis.inverse_dynamics import inverse_dynamics as inverse_dynamics
    from modalprep.multibody.analysis.inverse_kinematics import InverseKinematics as InverseKinematics
    from modalprep.multibody.analysis.inverse_kinematics import Target as Target
    from modalprep.multibody.analysis.inverse_kinematics import inverse_kinematics as inverse_kinematics
    from modalprep.multibody.analysis.root_locus import root_locus as root_locus
    from modalprep.multibody.analysis.spin import SpinModes as SpinModes
    from modalprep.multibody.analysis.spin import spin_modes as spin_modes
    from modalprep.multibody.analysis.state_space import LinearSystem as LinearSystem
    from modalprep.multibody.analysis.state_space import StateSpace as StateSpace
    from modalprep.multibody.analysis.state_space import frequency_response as frequency_response
    from modalprep.multibody.analysis.system_modes import SystemModes as SystemModes
    from modalprep.multibody.analysis.tangent import Tangent as Tangent
    from modalprep.multibody.analysis.tangent import TangentErrors as TangentErrors
    from modalprep.multibody.checkpoints import join_runs as join_runs
    from modalprep.multibody.control.estimator import Estimator as Estimator
    from modalprep.multibody.control.estimator import compensator as compensator
    from modalprep.multibody.control.estimator import kalman as kalman
    from modalprep.multibody.control.in_system import control_laws as control_laws
    from modalprep.multibody.control.in_system import state_feedback as state_feedback
    from modalprep.multibody.control.regulator import Regulator as Regulator
    from modalprep.multibody.control.regulator import lqr as lqr
    from modalprep.multibody.control.truncation import ReducedSystem as ReducedSystem
    from modalprep.multibody.control.truncation import balanced_truncation as balanced_truncation
    from modalprep.multibody.deploying.simulate import simulate_deployment as simulate_deployment
    from modalprep.multibody.deploying.system import DeployingSystem as DeployingSystem
    from modalprep.multibody.evaluation.coordinates import Coordinates as Coordinates
    from modalprep.multibody.evaluation.coordinates import JointState as JointState
    from modalprep.multibody.evaluation.coordinates import coordinates as coordinates
    from modalprep.multibody.evaluation.equations_of_motion import EquationsOfMotion as EquationsOfMotion
    from modalprep.multibody.evaluation.feedback import feedback as feedback
    from modalprep.multibody.evaluation.impact import Impact as Impact
    from modalprep.multibody.evaluation.impact import impact as impact
    from modalprep.multibody.evaluation.state import Frame as Frame
    from modalprep.multibody.evaluation.state import State as State
    from modalprep.multibody.evaluation.system_state import SystemState as SystemState
    from modalprep.multibody.free_body.free_flyer import FreeBodyMotion as FreeBodyMotion
    from modalprep.multibody.free_body.free_flyer import simulate_free_body as simulate_free_body
    from modalprep.multibody.model.chain import Chain as Chain
    from modalprep.multibody.model.chain import SegmentedBeam as SegmentedBeam
    from modalprep.multibody.model.constraints import Closure as Closure
    from modalprep.multibody.model.constraints import Coupler as Coupler
    from modalprep.multibody.model.depletion import Depletion as Depletion
    from modalprep.multibody.model.depletion import ExpelledGas as ExpelledGas
    from modalprep.multibody.model.depletion import deplete as deplete
    from modalprep.multibody.model.deployment import Deployment as Deployment
    from modalprep.multibody.model.environment import CentralGravity as CentralGravity
    from modalprep.multibody.model.environment import Conductor as Conductor
    from modalprep.multibody.model.environment import Dipole as Dipole
    from modalprep.multibody.model.environment import Orbit as Orbit
    from modalprep.multibody.model.hydrodynamics import ImmersedRod as ImmersedRod
    from modalprep.multibody.model.hydrodynamics import Water as Water
    from modalprep.multibody.model.joint_element import HingeElement as HingeElement
    from modalprep.multibody.model.loads import *  # noqa: F403
    from modalprep.multibody.model.rotational_spring import RotationalSpring as RotationalSpring
    from modalprep.multibody.model.time_function import Piece as Piece
    from modalprep.multibody.model.time_function import TimeFunction as TimeFunction
    from modalprep.multibody.results.envelopes import Envelope as Envelope
    from modalprep.multibody.results.envelopes import envelopes as envelopes
    from modalprep.multibody.results.recovered import body_motion as body_motion
    from modalprep.multibody.rotors.bearings import BearingCoefficients as BearingCoefficients
    from modalprep.multibody.rotors.bearings import read_bearing as read_bearing
    from modalprep.multibody.rotors.bearings import short_journal_bearing as short_journal_bearing
    from modalprep.multibody.rotors.campbell import Campbell as Campbell
    from modalprep.multibody.rotors.campbell import CriticalSpeed as CriticalSpeed
    from modalprep.multibody.rotors.campbell import campbell as campbell
    from modalprep.multibody.rotors.squeeze_film import squeeze_film_damper as squeeze_film_damper
    from modalprep.multibody.rotors.unbalance import UnbalanceResponse as UnbalanceResponse
    from modalprep.multibody.rotors.unbalance import unbalance_response as unbalance_response
    from modalprep.multibody.rotors.whirl import WhirlModes as WhirlModes
    from modalprep.multibody.rotors.whirl import whirl_modes as whirl_modes
    from modalprep.multibody.starts import state_at as state_at
else:  # type checkers would take any name
    __getattr__, __dir__, __all__ = lazy(__name__)
