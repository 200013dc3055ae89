"""Good decks of the kinds that few have: mirrored and external parts, dampers, sectors, gaps, what an analysis asks."""

from pathlib import Path

import numpy as np
from fe.ansys_decks import eblock, nblock
from fe.readers.ansys.test_read import ENDS_OF_SECTOR, SECTOR
from fe.readers.nastran.test_placed_parts import EXTERNAL, MIRROR, ON_PLANE, RIGHT, write_output4
from fe.readers.test_damper_decks import BARS, CARDS, DASHPOTS, INP

POINTS = "".join(f"GRID,{k},,{x:.1f},0.,0.\n" for k, x in ((21, 0), (22, 1), (23, 2), (24, 3)))
BEAMS = "CBAR,1,5,21,22,0.,1.,0.\nCBAR,2,5,23,24,0.,1.,0.\nPBAR,5,7,.01,3.-6,2.-6,4.-6\nMAT1,7,2.+11,,.3,8000.\n"
EXTOP4 = (
    f"{EXTERNAL}{POINTS}{BEAMS}SEBULK,1,EXTOP4,,,,,31\nBEGIN SUPER=1\n{POINTS}"
    "EXTRN,22,123,23,123\nASET1,123,22,23\nENDDATA\n"
)
ODD = f"""SOL 103
CEND
SUBCASE 1
LOAD=3
SPC=4
NSM=6
SUBCASE 2
METHOD=1
STATSUB=1
SDAMPING=5
BEGIN BULK
{POINTS}{BEAMS}GRID,25,,2.,1.,0.
CGAP,7,8,22,23,0.,1.,0.
PGAP,8,,,1.+5,1.+2,1.+4
RSPLINE,9,.1,21,22,123456,25
CELAS2,11,1.+5,21,1,22,1
CONM2,12,21,,5.
NSM1,6,PBAR,2.,5
EIGRL,1,,100.,10
TABDMP1,5,CRIT
,0.,.01,100.,.02,ENDT
FORCE,3,24,,10.,0.,1.,0.
PLOAD1,3,1,FY,FR,0.,5.,1.,5.
SPC1,4,123456,21
ENDDATA
"""
RING = """*NODE, NSET=all
1, 1., 0., 0.
2, 2., 0., 0.
3, 0., 1., 0.
4, 0., 2., 0.
*ELEMENT, TYPE=S4, ELSET=e
1, 1, 2, 4, 3
*MATERIAL, NAME=m
*ELASTIC
2e11, .3
*DENSITY
7800.
*SHELL SECTION, ELSET=e, MATERIAL=m
.01
*NSET, NSET=low
1, 2
*NSET, NSET=high
3, 4
*SURFACE, NAME=l, TYPE=NODE
low
*SURFACE, NAME=h, TYPE=NODE
high
*TIE, CYCLIC SYMMETRY, NAME=t
h, l
*CYCLIC SYMMETRY MODEL, N=4, NGRAPH=4, TIE=t
0, 0, 0, 0, 0, 1
*STEP, NLGEOM
*STATIC
*DLOAD
e, CENTRIF, 100., 0, 0, 0, 0, 0, 1
*END STEP
*STEP, PERTURBATION
*FREQUENCY
4
*SELECT CYCLIC SYMMETRY MODES, NMIN=0, NMAX=2
*END STEP
"""
FIELDS = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 0, 1)]
PIPES = "\n".join(
    [
        *("/PREP7", "ET,1,288", "ET,2,14", "ET,3,180", "MP,EX,1,2e11", "MP,PRXY,1,.3", "MP,DENS,1,7800."),
        *("MP,DENS,2,1000.", "SECTYPE,1,PIPE", "SECDATA,.1,.01,8,,,2,2,.02", "R,2,1e5,3.", "R,3,.01,5.,1"),
        *nblock(FIELDS),
        *eblock((1, 2, 4), (2, 3, 4)),
        *eblock((1, 2), kind=2, real=2, section=0, first=7),
        *eblock((2, 3), kind=3, real=3, section=0, first=8),
        *("D,1,UX,0,,3,2,UY,UZ", "F,2,FX,5.,,3,1", "M,2,ALL,3", "PSTRES,ON", "MODOPT,LANB,5", "ACEL,,,9.81"),
        "FINISH\n",
    ]
)
KINDS = {
    "mirror.bdf": "CEND\nBEGIN BULK\n" + ON_PLANE + MIRROR + "SELOC,2,1,2,3,1,2,3\nBEGIN SUPER=1\n" + RIGHT,
    "external.bdf": EXTOP4,
    "dampers.bdf": BARS + "".join(f"{cards}" for cards in CARDS if cards.startswith(("CDAMP1", "CVISC"))) + "ENDDATA\n",
    "odd.bdf": ODD,
    "dashpots.inp": INP + next(iter(DASHPOTS)),
    "sector.inp": RING,
    "sector.cdb": "\n".join(["/PREP7", *SECTOR, *ENDS_OF_SECTOR, "CYCLIC,4", "CYCOPT,HINDEX,ALL", "FINISH", ""]),
    "pipes.cdb": PIPES,
}


def write_matrices_of_the_part(path: Path) -> None:
    """Write `path`, the file of the matrices of `EXTOP4`: a spring of 1e6 N/m and two masses of 5 kg."""
    spring = np.kron([[1.0, -1.0], [-1.0, 1.0]], np.diag([1e6, 0.0, 0.0]))
    write_output4(path, {"KAAX": spring, "MAAX": 5.0 * np.eye(6)})
