"""The beam of meshes/beam.msh in pipeline files: the tables with which the files of many tests begin, for `format`."""

PART = """
[mesh]
file = "{mesh}"

[materials.alloy]
E = 7e10
nu = 0.4
rho = 3000.0

[properties.beam]
type = "beam"
material = "alloy"
"""
ROOT = """
[interfaces.root]
group = "root"
kind = "node"
"""
TIP = """
[interfaces.tip]
group = "tip"
kind = "node"
boundary = "free"
"""
RECTANGLE = PART + 'section = {{ shape = "rectangle", width = 0.3, height = 0.2 }}\n' + ROOT
SLENDER = PART + "A = 4e-4\nIy = 8e-7\nIz = 2e-7\nJ = 5e-7\n" + ROOT
