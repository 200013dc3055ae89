"""A solar panel on its yoke as a Nastran deck, in mm, t and s: `python meshes/solar_panel.py` writes solar-panel.bdf.

Nothing but Python is needed, and the deck has the same bytes every time.
"""

from pathlib import Path

# mm
LENGTH, WIDTH, ROOT = 2000.0, 1200.0, 400.0  # of the panel along x and y, and where it begins
NX, NY = 10, 6  # elements along x and y
FEET = (1, 5)  # nodes of the near edge, counted along y, that carry the panel
PARTS = 4  # of each arm of the yoke
HINGE = 1000  # number of the grid

CARDS = """\
$ A solar panel on its yoke, in mm, t and s. meshes/solar_panel.py wrote it.
SOL 103
CEND
TITLE = SOLAR PANEL
SPC = 1
METHOD = 1
BEGIN BULK
EIGRL,1,,,10
$ sandwich: two sheets of 0.3 mm, a honeycomb of 20 mm, cells and cables of 1.2 kg/m2
PCOMP,1,,1.2-9,,,,,
,1,.3,0.,NO,2,20.,0.,NO
,1,.3,0.,NO
MAT1,1,70000.,,.33,2.7-9
MAT8,2,10.,10.,.3,10.,150.,150.,5.-11
$ yoke: tubes of carbon fibre
PBARL,2,3,,TUBE,,,,
,6.,5.2
MAT1,3,100000.,,.3,1.6-9
$ drive and hinge
CONM2,9001,1000,,5.-4
SPC1,1,123456,1000
"""


def node(i, j):
    """Return the number of a grid of the panel, i along x and j along y."""
    return 1 + i + (NX + 1) * j


def grid(number, x, y):
    return f"GRID,{number},,{x:.8g},{y:.8g},0."


def panel():
    """Yield the grids and quads of the panel."""
    for j in range(NY + 1):
        for i in range(NX + 1):
            yield grid(node(i, j), ROOT + LENGTH * i / NX, WIDTH * (j / NY - 0.5))
    for j in range(NY):
        for i in range(NX):
            corners = node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)
            yield f"CQUAD4,{1 + i + NX * j},1,{','.join(map(str, corners))}"


def yoke():
    """Yield the grids and bars of the two arms, from the hinge to the near edge of the panel."""
    yield grid(HINGE, 0, 0)
    for arm, j in enumerate(FEET):
        names = [HINGE, *(HINGE + 100 * (arm + 1) + k for k in range(1, PARTS)), node(0, j)]
        for k in range(1, PARTS):
            yield grid(names[k], ROOT * k / PARTS, WIDTH * (j / NY - 0.5) * k / PARTS)
        for k in range(PARTS):
            yield f"CBAR,{2001 + PARTS * arm + k},2,{names[k]},{names[k + 1]},0.,0.,1."


if __name__ == "__main__":
    lines = [CARDS.rstrip("\n"), *panel(), *yoke(), "ENDDATA"]
    Path(__file__).with_name("solar-panel.bdf").write_text("\n".join(lines) + "\n")
