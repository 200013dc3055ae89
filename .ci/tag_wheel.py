"""A wheel with the library of compiled kernels is for one platform and for every Python; without it numba is needed."""

import os
import tomllib
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class TagOfCompiledCode(BuildHookInterface):
    def initialize(self, version, build_data):
        if (Path(self.root) / "src" / "modalprep" / "compiled").is_dir():
            build_data["pure_python"] = False
            build_data["tag"] = os.environ["MODALPREP_WHEEL"]  # of .ci/build-wheel
        else:
            project = tomllib.loads((Path(self.root) / "pyproject.toml").read_text())["project"]
            build_data["dependencies"] += [x for x in project["optional-dependencies"]["build"] if "numba" in x]
