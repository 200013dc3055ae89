"""Analyses in pipeline files: equilibrium, modes, linear equations, frequency response, inverse dynamics."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from modalprep.formats.statespace import WRITERS
from modalprep.pipeline.schema.base import ReferenceTable, Table
from modalprep.pipeline.schema.system import EACH, THEORY, Theory
from modalprep.pipeline.schema.time import TIME, Time


class ResponseTable(Table):
    """Frequencies of a response to harmonic inputs, on a logarithmic grid."""

    lowest: float = Field(gt=0, description="Hz")
    highest: float = Field(gt=0, description="Hz")
    points: Annotated[int, Field(ge=2, le=100_000)] = 400

    @model_validator(mode="after")
    def _ascending(self) -> ResponseTable:
        if not self.lowest < self.highest:
            raise ValueError(f"lowest = {self.lowest:g} Hz must be below highest = {self.highest:g} Hz")
        return self


class SweepTable(Table):
    """Modes at many times: loads and masses change with time, the reference state does not move."""

    until: float = Field(gt=0, description="s, end of the sweep, which begins at `time`")
    points: Annotated[int, Field(ge=2, le=10_000)] = 100
    modes: Annotated[int, Field(ge=1)] = Field(6, description="lowest that vibrate")
    label: str = Field("time (s)", description="label of the axis, for loads that are ramps of another parameter")
    reference: list[ReferenceTable] = Field([], description="reference frequencies (y, Hz) over time (t) for the plot")


class InverseTable(Table):
    """Inverse dynamics: hinge forces of a prescribed motion."""

    motion: Annotated[dict[str, Time | list[Time]], Field(min_length=1)] = Field(
        description="by joint, m or rad: " + TIME + EACH
    )
    t_end: float = Field(gt=0, description="s")
    output_step: float = Field(0.01, gt=0, description="s")
    modes: Literal["dynamic", "quasi_static"] = Field(
        "dynamic", description="quasi_static: modes in quasi-static equilibrium at each time"
    )
    rtol: float = Field(1e-9, ge=1e-13, le=1e-2, description="relative tolerance of modes and joints without a history")


class AnalysisTable(Table):
    """Equilibrium, modes, linear equations, frequency response and hinge forces of the system."""

    about: Literal["equilibrium", "steady", "start"] = Field(
        "equilibrium", description="reference state; steady: equilibrium while prescribed joints move"
    )
    time: float = Field(0.0, ge=0, description="s, at which functions of time are taken")
    theory: Theory = Field("consistent", description=THEORY)
    modes: Annotated[int, Field(ge=0)] = Field(20, description="modes of the system to list")
    inputs: list[str] = Field([], description="'joint', 'joint.2', 'body.interface.force.x', '... .torque.x'")
    outputs: list[str] = Field(
        [], description="'joint.angle', 'body.modal.1', 'body.interface.position.x', also velocity, acceleration, ..."
    )
    state_space: list[Literal[*WRITERS]] = Field([], description="files to write A, B, C, D to")
    response: ResponseTable | None = Field(None, description="of the outputs to harmonic inputs")
    sweep: SweepTable | None = Field(None, description="modes over time")
    inverse: InverseTable | None = None

    @model_validator(mode="after")
    def _response_of_what(self) -> AnalysisTable:
        if self.response is not None and not (self.inputs and self.outputs):
            raise ValueError("a response needs both 'inputs' and 'outputs'")
        return self
