"""The modal body: integrals, geometric stiffness, checks."""

from __future__ import annotations

from modalprep.lazy import lazy

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from modalprep.body.checks import Check as Check
    from modalprep.body.checks import CheckReport as CheckReport
    from modalprep.body.checks import check_model as check_model
    from modalprep.body.coupling import CouplingMatrices as CouplingMatrices
    from modalprep.body.coupling import coupling_matrices as coupling_matrices
    from modalprep.body.flexible_body import FlexibleBody as FlexibleBody
    from modalprep.body.frames import at_centre_of_mass as at_centre_of_mass
    from modalprep.body.frames import in_frame as in_frame
    from modalprep.body.frames import in_mean_axes as in_mean_axes
    from modalprep.body.frames import in_principal_axes as in_principal_axes
    from modalprep.body.frames import reroot as reroot
    from modalprep.body.levels import with_density_factor as with_density_factor
    from modalprep.body.linearised_stiffness import linearised_geometric_stiffness as linearised_geometric_stiffness
    from modalprep.body.mass import mass_matrix as mass_matrix
    from modalprep.body.recovery import BodyMotion as BodyMotion
    from modalprep.body.recovery import Recovery as Recovery
    from modalprep.body.recovery import at_rest as at_rest
    from modalprep.body.stations.number import stations_for as stations_for
    from modalprep.body.stations.record import OutsideBasis as OutsideBasis
    from modalprep.body.stations.record import Stations as Stations
    from modalprep.body.stress import StressModes as StressModes
    from modalprep.body.verify import check_buckling as check_buckling
    from modalprep.body.verify import check_projection as check_projection
else:  # type checkers would take any name
    __getattr__, __dir__, __all__ = lazy(__name__)
