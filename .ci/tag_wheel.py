"""A wheel with compiled kernels is for one Python and one platform."""

from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class TagOfCompiledCode(BuildHookInterface):
    def initialize(self, version, build_data):
        compiled = Path(self.root) / "src" / "modalprep" / "compiled"
        build_data["pure_python"] = not compiled.is_dir()
        build_data["infer_tag"] = compiled.is_dir()
