"""The table of a pipeline file that says how its motion is drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from modalprep.pipeline.schema.base import Table

if TYPE_CHECKING:
    from modalprep.report.scene.style import FilmStyle

Pixels = Annotated[int, Field(ge=100, le=4000, multiple_of=2)]


class FilmTable(Table):
    """How animations of the system are drawn: of [output] film, simulate --animate, and modalprep film."""

    colour: str = Field(
        default="displacement", description="displacement, or a recovery over the mesh such as skin.von_mises"
    )
    exaggeration: float = Field(default=1.0, gt=0, description="factor of the deflections, which the picture states")
    trails: list[str] = Field(default=[], description="interfaces, such as arm.tip, that draw their path behind them")
    follow: str = Field(default="", description="body that the camera follows; default: the camera stays")
    boxes: list[str] = Field(default=[], description="rigid bodies drawn as the uniform box of their mass and inertia")
    title: str = Field(default="", description="text in the picture")
    seconds: float = Field(default=5.0, gt=0, description="duration of the animation, s")
    frames: int = Field(default=60, ge=2, le=2000, description="number of its pictures")
    size: list[Pixels] = Field(
        default=[720, 540], min_length=2, max_length=2, description="width and height in pixels, even numbers"
    )

    def style(self) -> FilmStyle:
        """Return what the drawing functions take."""
        from modalprep.report.scene.style import FilmStyle

        names = ("colour", "exaggeration", "trails", "follow", "boxes", "title")
        return FilmStyle(**{name: getattr(self, name) for name in names})
