"""What people look at: tables, charts, pictures, the HTML page."""

from __future__ import annotations

from modalprep.lazy import lazy

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all of this
if TYPE_CHECKING:
    from modalprep.report.body_page.inputs import Inputs as Inputs
    from modalprep.report.body_page.section import Section as Section
    from modalprep.report.body_page.section import chart as chart
    from modalprep.report.body_page.section import paragraph as paragraph
    from modalprep.report.body_page.table import Table as Table
    from modalprep.report.charts.mass_chart import effective_mass_plot as effective_mass_plot
    from modalprep.report.charts.plots import history_plot as history_plot
    from modalprep.report.page import BodyPage as BodyPage
    from modalprep.report.page import write_page as write_page
    from modalprep.report.pictures.animation import animate_mode as animate_mode
    from modalprep.report.pictures.mesh_picture import render_findings as render_findings
    from modalprep.report.pictures.render import render_mesh as render_mesh
    from modalprep.report.pictures.render import render_mode as render_mode
    from modalprep.report.pictures.sheet import contact_sheet as contact_sheet
    from modalprep.report.pictures.system_animation import animate_system as animate_system
    from modalprep.report.pictures.system_animation import render_motion as render_motion
    from modalprep.report.run_page.page import RunPage as RunPage
    from modalprep.report.run_page.page import write_run_page as write_run_page
    from modalprep.report.scene.style import FilmStyle as FilmStyle
    from modalprep.report.view.page import view_body as view_body
    from modalprep.report.view.page import view_mesh as view_mesh
    from modalprep.report.view.page import view_run as view_run
else:  # type checkers would take any name
    __getattr__, __dir__, __all__ = lazy(__name__)
