"""Corners around the faces and edges of mesh cells, in the order of nodes that meshio and VTK share."""

FACES = {  # seen from outside; of the hexahedron in the order of the nodes in the middle of its faces
    "triangle": ((0, 1, 2),),
    "quad": ((0, 1, 2, 3),),
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "hexahedron": ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (2, 3, 7, 6), (0, 3, 2, 1), (4, 5, 6, 7)),
}
EDGES = {  # corners at the ends of each edge, in the order of the mid-side nodes
    "triangle": ("01", "12", "02"),
    "quad": ("01", "12", "23", "03"),
    "tetra": ("01", "12", "02", "03", "13", "23"),
    "pyramid": ("01", "12", "23", "03", "04", "14", "24", "34"),
    "wedge": ("01", "12", "02", "34", "45", "35", "03", "14", "25"),
    "hexahedron": ("01", "12", "23", "03", "45", "56", "67", "47", "04", "15", "26", "37"),
}
