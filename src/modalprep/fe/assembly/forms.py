"""The forms that `assemble` can take by name."""

from __future__ import annotations

from typing import Literal

from modalprep.fe.assembly.compiled_forms import COMPILED
from modalprep.fe.assembly.plain_forms import PLAIN
from modalprep.fe.assembly.structure_forms import ModelForms

FormsName = Literal["compiled", "plain"]
FORMS: dict[str, ModelForms] = {"compiled": COMPILED, "plain": PLAIN}
