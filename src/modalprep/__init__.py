"""modalprep: finite-element meshes to flexible bodies for multibody dynamics, and their simulation.

The names of the tour stand here, the others in `modalprep.fe`, `reduction`, `body`, `supplied`, `multibody`,
`ensemble`, `sensitivity`, `formats`, `correlation`, `response`, `report` and `linalg`. A name is loaded on first use,
so that ``import modalprep`` costs nothing.
"""

from __future__ import annotations

from modalprep.lazy import lazy

__version__ = "0.1.0"

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from modalprep import body as body
    from modalprep import correlation as correlation
    from modalprep import ensemble as ensemble
    from modalprep import fe as fe
    from modalprep import formats as formats
    from modalprep import linalg as linalg
    from modalprep import multibody as multibody
    from modalprep import reduction as reduction
    from modalprep import report as report
    from modalprep import response as response
    from modalprep import sensitivity as sensitivity
    from modalprep import supplied as supplied
    from modalprep.body.build import flexible_body as flexible_body
    from modalprep.body.checks import check_body as check_body
    from modalprep.body.rigid import rigid_body as rigid_body
    from modalprep.drawing import Film as Film
    from modalprep.drawing import Page as Page
    from modalprep.ensemble.simulate import simulate_many as simulate_many
    from modalprep.errors import AccuracyError as AccuracyError
    from modalprep.errors import InputError as InputError
    from modalprep.errors import MechanismError as MechanismError
    from modalprep.errors import ModalprepError as ModalprepError
    from modalprep.errors import ModalprepWarning as ModalprepWarning
    from modalprep.errors import NotInstalledError as NotInstalledError
    from modalprep.errors import OutputError as OutputError
    from modalprep.errors import RenderError as RenderError
    from modalprep.errors import SimulationError as SimulationError
    from modalprep.fe.assembly.assemble import assemble as assemble
    from modalprep.fe.generation.generate import make_mesh as make_mesh
    from modalprep.fe.links.interface import Connection as Connection
    from modalprep.fe.links.interface import Interface as Interface
    from modalprep.fe.links.support import Support as Support
    from modalprep.fe.properties.materials import Material as Material
    from modalprep.fe.properties.points import PointMass as PointMass
    from modalprep.fe.properties.points import Spring as Spring
    from modalprep.fe.properties.properties import Beam as Beam
    from modalprep.fe.properties.properties import Shell as Shell
    from modalprep.fe.properties.properties import Solid as Solid
    from modalprep.fe.properties.properties import Truss as Truss
    from modalprep.fe.quality.quality import check_mesh as check_mesh
    from modalprep.fe.readers.read import read_mesh as read_mesh
    from modalprep.fe.terms.added_mass import AddedMass as AddedMass
    from modalprep.fe.terms.foundation import Foundation as Foundation
    from modalprep.formats.modalfile import read_body as read_body
    from modalprep.formats.modalfile import write_body as write_body
    from modalprep.formats.resultfile import read_result as read_result
    from modalprep.formats.resultfile import write_result as write_result
    from modalprep.multibody.analysis.equilibrium import static_equilibrium as static_equilibrium
    from modalprep.multibody.analysis.linearise import linearise as linearise
    from modalprep.multibody.analysis.system_modes import system_modes as system_modes
    from modalprep.multibody.model.events import Event as Event
    from modalprep.multibody.model.joint import Joint as Joint
    from modalprep.multibody.model.loads import PointForce as PointForce
    from modalprep.multibody.model.system import System as System
    from modalprep.multibody.results.result import Result as Result
    from modalprep.multibody.simulate import simulate as simulate
    from modalprep.reduction.craig_bampton import craig_bampton as craig_bampton
    from modalprep.reduction.craig_bampton import guyan as guyan
    from modalprep.sensitivity.gradient import gradient as gradient
    from modalprep.sensitivity.identification import identify as identify
    from modalprep.sensitivity.run_sensitivities import run_sensitivities as run_sensitivities
    from modalprep.sensitivity.shooting import steer as steer
    from modalprep.verdicts.verdict import Requirement as Requirement
    from modalprep.verdicts.verdict import Verdict as Verdict
else:  # type checkers would take any name
    __getattr__, __dir__, __all__ = lazy(__name__)
