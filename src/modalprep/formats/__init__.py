"""Files: the modal file, simulation results, and bodies of other programs."""

from __future__ import annotations

from modalprep.lazy import lazy

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from modalprep.formats.bodies.described import notes_of as notes_of
    from modalprep.formats.bodies.read import import_body as import_body
    from modalprep.formats.coupling import write_coupling as write_coupling
    from modalprep.formats.export import export_body as export_body
    from modalprep.formats.exudyn import write_exudyn as write_exudyn
    from modalprep.formats.mbdyn import write_mbdyn as write_mbdyn
    from modalprep.formats.nastran import write_dmig as write_dmig
    from modalprep.formats.nastran import write_output4 as write_output4
    from modalprep.formats.responsefile import read_response as read_response
    from modalprep.formats.responsefile import write_response as write_response
    from modalprep.formats.resultfile import read_csv as read_csv
    from modalprep.formats.resultfile import write_csv as write_csv
    from modalprep.formats.robots.mjcf_write import write_mjcf as write_mjcf
    from modalprep.formats.robots.read import read_mjcf as read_mjcf
    from modalprep.formats.robots.read import read_urdf as read_urdf
    from modalprep.formats.robots.write import write_urdf as write_urdf
    from modalprep.formats.sid import write_sid as write_sid
    from modalprep.formats.statefile import read_state as read_state
    from modalprep.formats.statefile import write_state as write_state
    from modalprep.formats.statespace import write_state_space as write_state_space
    from modalprep.formats.uff import write_uff as write_uff
    from modalprep.formats.vtu import write_vtu as write_vtu
    from modalprep.formats.vtu import write_vtu_series as write_vtu_series
else:  # type checkers would take any name
    __getattr__, __dir__, __all__ = lazy(__name__)
