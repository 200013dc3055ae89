"""What the reader does with each Nastran card: tables of other cards, elements, links, and what is left out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from modalprep.fe.mesh.left_out import left_out
from modalprep.fe.readers.coverage import Entry
from modalprep.fe.readers.nastran import (
    analysis,
    constraints,
    elements,
    links,
    loads,
    matrices,
    nonstructural,
    points,
    superelements,
)
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.numbers import real


class Table(NamedTuple):
    """Cards that others refer to: those of one family share their ids; of a list each stands for itself."""

    family: str
    listed: bool = False

    def __call__(self, tables: dict[str, dict[int, Card]], card: Card) -> None:
        """File a card."""
        table = tables.setdefault(self.family, {})
        if self.listed:
            table[len(table)] = card
            return
        for entry in _entries(card):
            known = table.setdefault(entry.id, entry)
            if known is not entry and not known.same(entry):
                raise entry.error(f"another {known.name} in line {known.line} has this id; keep one of the two")


def _entries(card: Card) -> list[Card]:
    """Split the cards that hold several entries."""
    width = {"CORD1": 4, "PELAS": 4, "PVISC": 4, "PMASS": 2, "PDAMP": 2}.get(card.name[:5])
    if width is None:
        return [card]
    parts = [card.fields[k : k + width] for k in range(0, min(len(card.fields), 8), width)]
    return [Card(card.name, part, card.file, card.line) for part in parts if any(part)]


FAMILIES = {
    "grid": "GRID",
    "system": "CORD1R CORD1C CORD1S CORD2R CORD2C CORD2S",
    "material": "MAT1 MAT2 MAT3 MAT8 MAT9 MAT10 MAT11",
    "shell": "PSHELL PCOMP PCOMPG",
    "bar": "PBAR PBARL",
    "beam": "PBEAM PBEAML",
    "bend": "PBEND",
    "rod": "PROD",
    "tube": "PTUBE",
    "shear": "PSHEAR",
    "solid": "PSOLID",
    "bush": "PBUSH",
    "elas": "PELAS",
    "damp": "PDAMP",
    "visc": "PVISC",
    "bush1d": "PBUSH1D",
    "gap": "PGAP",
    "mass": "PMASS",
}
LISTS = (
    "GRDSET",
    "BAROR",
    "BEAMOR",
    "PARAM",
    "DMIG",
    "SPOINT",
    "SPCADD",
    *constraints.LISTS,
    *nonstructural.LISTS,
    *links.SUPPORTS,
    *links.NODE_SETS,
    *loads.LISTS,
    *analysis.LISTS,
)

REMARKS = {
    "PBARL": "Area and moments are exact; torsion constant and, but for ROD, shear factors are those of the textbook.",
    "PBEAML": "As PBARL; a taper is linear between its stations; the shear centre is that of Nastran for T, T1, T2 and "
    "I, of thin walls for the others.",
    "PBEAM": "A taper is linear between its stations; warping, shear relief and the offset of nsm are left out.",
    "PSOLID": "IN = 2 is reduced integration of CHEXA with 20 grids; MSC's default, 3 x 3 x 3 points with reduced "
    "shear, is full integration here. CHEXA with 8 grids has incompatible modes.",
    "PSHELL": "MID4, the coupling of membrane and bending, is refused.",
    "PBUSH": "The rows K, B and M are read, half of the mass at each end; others are left out with a note.",
    "PBUSH1D": "K and C; a mass is refused, laws of force and damping are left out with a note.",
    "CBUSH": "Also with an elastic centre by OCID, S1, S2, S3.",
    "RSPLINE": "Of a thin tube without Poisson's ratio, which matters where its grids lie on no straight line.",
    "CGAP": "As a spring, open or closed, as gaps of the mesh says; refused without. Preload is left out.",
    "PTUBE": "A taper is replaced by its mean.",
    "MAT2": "For shells, where it is orthotropic along the material's axes.",
    "PARAM": "WTMASS, COUPMASS, CK2 and CM2 are read; CK1, CM1, G, W3, W4, ALPHA1, ALPHA2, K6ROT and SNORM are "
    "noted; others do nothing.",
    "CELAS1": "Between distant grids it acts through rigid arms to the middle.",
    "CELAS2": "Between distant grids it acts through rigid arms to the middle.",
    "CDAMP1": "Between distant grids it acts through rigid arms to the middle.",
    "CDAMP2": "Between distant grids it acts through rigid arms to the middle.",
    "CBEND": "Sixteen straight beams between new grids follow the arc.",
    "PBEND": "The ovalling of pipes and the offsets RC, ZC and DELTAN are left out with a note.",
    "CSHEAR": "A sheet that keeps 1e-6 of its normal stiffness; F1 and F2 become rods along its edges.",
    "CMASS1": "A mass that acts in all three directions of a grid, or an inertia of its rotations.",
    "CMASS2": "A mass that acts in all three directions of a grid, or an inertia of its rotations.",
    "NSML": "The mass of a property is spread over the length or area of its elements with straight edges.",
    "NSML1": "The mass is spread over the length or area of all elements that it names, with straight edges.",
    **dict.fromkeys(
        ("CELAS3", "CELAS4", "CDAMP3", "CDAMP4", "CMASS3", "CMASS4"),
        "On scalar points that nothing joins to grids it is left out with a note; on others it is refused.",
    ),
    **dict.fromkeys(
        loads.READ,
        "A set is a load of the mesh, for [loads]; gravity is for modalprep init.",
    ),
    "PLOAD1": "Forces and moments along basic axes or those of the beam, by length or fraction; per projected length "
    "for forces along basic axes.",
    "LOAD": "The sum of loads; the mesh's load of its number.",
    **dict.fromkeys(analysis.LISTS, "For modalprep init: count and band of modes, damping."),
    "DMIG": "Where K2GG or M2GG of the case control selects it, with factors and the parameters CK2, CM2, as stiffness "
    "and mass beside the elements; others are left out with a note. A deck of matrices alone is one for [matrices].",
    "GENEL": "With K or Z, and S as given or of a rigid motion. A K that resists rigid motions is refused.",
    "CONM1": "The matrix of a rigid body; others are refused.",
}
APPROXIMATED = {
    "PSOLID",
    "PBARL",
    "PBEAML",
    "PBEAM",
    "PTUBE",
    "CBEND",
    "PBEND",
    "CELAS1",
    "CELAS2",
    "CDAMP1",
    "CDAMP2",
    "CSHEAR",
    "RSPLINE",
    "CGAP",
}

QUIET = """
PLOTEL PLOTEL3 PLOTEL4 DLOAD TLOAD1 TLOAD2 RLOAD1 RLOAD2 LSEQ DAREA TABLED1 TABLED2 TABLED3 TABLED4 TABLEM1 TABLEM2
TABLEM3 TABLEM4 TABLES1 TABLEST TABRND1 EIGB EIGC EIGP TSTEP TSTEPNL FREQ FREQ1 FREQ2 FREQ3 FREQ4 FREQ5 SET1 SET2 SET3
TEMP TEMPD TEMPP1 TEMPRB TEMPADD DPHASE DELAY DRESP1 DRESP2 DRESP3 DESVAR DCONSTR DCONADD DVPREL1 DVPREL2 DVMREL1
DOPTPRM DLINK DSCREEN MDLPRM NLPARM NLPCI CSUPEXT OMIT OMIT1 ECHOOFF ECHOON DTI USET USET1 RANDPS RANDT1 CREEP
BLSEG BFRIC BSURF BSURFS BCPROP BCPROPS BCPARA BCTPARA BCTPARM BGPARM BCRPARA BCRGSRF BCHANGE BCMATL SEBSET RELEASE
"""
CONTACT = "BCONP BCTSET BCTADD BCBODY BCBODY1 BCTABLE BCTABL1 BCONECT BCPAIR"
GLUE = "BGSET BGADD CINTC RBE2GS TIE"
DAMPING = "CDAMP5 PDAMP5 PBUSHT PELAST PDAMPT MATT1 MATS1 MATT8"
MATRICES = "DMIAX TF"
AERODYNAMICS = (
    "DMI DMIJ DMIJI DMIK AERO AEROS AEFACT AELINK AELIST AEPARM AEPRESS AESTAT AESURF AESURFS AECOMP AECOMPL "
    "CAERO1 CAERO2 CAERO3 CAERO4 CAERO5 PAERO1 PAERO2 PAERO3 PAERO4 PAERO5 SPLINE1 SPLINE2 SPLINE3 SPLINE4 SPLINE5 "
    "SPLINE6 SPLINE7 MKAERO1 MKAERO2 FLFACT FLUTTER TRIM CSSCHD DIVERG GUST MONPNT1 MONPNT2 MONPNT3 MONDSP1 UXVEC"
)
REFUSED = {
    **dict.fromkeys(
        "CFAST CWELD CSEAM CSPOT CBUTT CFILLET CCRSFIL CBEAM3 CQUAD CTRIAX CTRIAX6 CQUADX CQUADX4 CQUADX8 "
        "CTRAX3 CTRAX6 CPLSTN3 CPLSTN4 CPLSTN6 CPLSTN8 CPLSTS3 CPLSTS4 CPLSTS6 CPLSTS8 CTRIA CRAC2D CRAC3D "
        "CDUM1 CTWIST CTRAPRG CTRIARG CHEXA1 CHEXA2 CIHEX1 CIHEX2 CIHEX3 CELBOW CIFHEX CIFPENT CIFQUAD CIFQDX "
        "CBUSH2D CBEAR CSSHL CSSHLP CMREBAI CMREBAR CGASK6 CGASK8 CGASK12 CGASK16 JOINTG".split(),
        "This element has no counterpart here.",
    ),
    **dict.fromkeys("PBCOMP PBMSECT PBRSECT PBEAM3 PCOMPLS".split(), "This section has no counterpart here."),
    **dict.fromkeys(MATRICES.split(), "This matrix is not read."),
    **dict.fromkeys(
        "MPCY RJOINT RSSCON RTRPLT RTRPLT1 RBAR1 CYJOIN CYAX".split(),
        "This constraint is not read.",
    ),
    **{name: f"It cannot be read: {remark}." for name, remark in superelements.REFUSED.items()},
    **dict.fromkeys(CONTACT.split(), "Contact is not linear; tie the parts, by RBE2 or MPC, or leave it out."),
    **dict.fromkeys(GLUE.split(), "It ties meshes that do not match; tie them by RBE3, RBE2 or MPC."),
    **dict.fromkeys("SEUPR SEDLINK".split(), "Trees of superelements are not read."),
    **dict.fromkeys("ACMODL CAABSF CHACAB CHACBR CHBDYE CHBDYG CHBDYP".split(), "Fluids and heat are not read."),
}
FLUIDS = {"CAABSF", "CHACAB", "CHACBR", "ACMODL", "CHBDYE", "CHBDYG", "CHBDYP"}


def _read(names: Iterable[str], handles) -> dict[str, Entry]:
    return {
        name: Entry("approximated" if name in APPROXIMATED else "read", REMARKS.get(name, ""), handle)
        for name, handle in zip(names, handles, strict=True)
    }


def _registry() -> dict[str, Entry]:
    found = {name: Entry("refused", remark) for name, remark in REFUSED.items()}
    found |= {name: Entry("no effect", "Fluids and heat are left out with a note.") for name in FLUIDS}
    found |= {name: Entry("no effect") for name in QUIET.split()}
    found |= {
        name: Entry("read", "It belongs to the parts of a deck with BEGIN SUPER.", Table(name, listed=True))
        for name in superelements.OWN
    }
    found |= {
        name: Entry("no effect", "Damping and nonlinear laws are left out with a note.") for name in DAMPING.split()
    }
    found |= {name: Entry("no effect", "Aerodynamics is left out with a note.") for name in AERODYNAMICS.split()}
    found |= _read(LISTS, (Table(name, listed=True) for name in LISTS))
    found |= {
        name: Entry("no effect", "Where a subcase selects it, modalprep init says so.", Table(name, listed=True))
        for name in loads.UNREAD
    }
    for family, names in FAMILIES.items():
        found |= _read(names.split(), (Table(family) for _ in names.split()))
    handlers = {**elements.HANDLERS, **points.HANDLERS, **links.HANDLERS, **matrices.HANDLERS}
    return dict(sorted((found | _read(handlers, handlers.values())).items()))


REGISTRY: dict[str, Entry] = _registry()

LONGEST = {  # fields that a card can have behind its name
    **{"GRID": 8, "CORD2R": 11, "CORD2C": 11, "CORD2S": 11, "CONM2": 15, "RBAR": 9},
    **{"CBAR": 16, "CBEAM": 18, "CROD": 4, "CTUBE": 4, "CONROD": 7, "CELAS1": 6, "CELAS2": 8, "CBUSH": 13},
    **{"CQUAD4": 14, "CTRIA3": 13, "CQUAD8": 17, "CTRIA6": 14, "CSHEAR": 6},
    **{"CTETRA": 12, "CPYRAM": 15, "CPENTA": 17, "CHEXA": 22},
    **{"SPC": 7, "FORCE": 7, "MOMENT": 7, "GRAV": 7, "CELAS3": 4, "CELAS4": 4, "CMASS1": 6, "CMASS2": 6},
    **{"CDAMP1": 6, "CDAMP2": 6, "CVISC": 4, "RROD": 6, "CONM1": 24, "PLOAD1": 8, "MAT2": 17},
    **{"MAT1": 12, "PBAR": 19, "PROD": 6, "PTUBE": 6, "PSHELL": 11, "PSOLID": 8, "PSHEAR": 6},
}


def refuse_surplus(card: Card) -> None:
    """Refuse a card with fields that it cannot have, which mostly belong to another one."""
    longest = LONGEST.get(card.name, len(card.fields))
    if len(card.fields) > longest:
        raise card.error(
            f"it has {len(card.fields)} fields and can have {longest}; give each continuation the marker of its card"
        )


GE = {  # field of the structural damping GE
    **{"MAT1": 7, "MAT2": 12, "MAT3": 15, "MAT8": 16, "MAT9": 30, "MAT11": 15},
    **{"PCOMP": 6, "PCOMPG": 6, "PELAS": 2, "CELAS2": 6},
}
PARAMETERS = {  # and the value that asks for what the model has
    **dict.fromkeys(("G", "W3", "W4", "ALPHA1", "ALPHA2", "K6ROT", "SNORM"), None),
    **{"COUPMASS": 1.0, "CK1": 1.0, "CM1": 1.0},
}
WARPING = 16  # field of the first of the two scalar points of a CBEAM
SEID = 7  # field of a grid
SAID_BESIDES = (
    "damping is given in the pipeline file, elements count once (CK1, CM1), superelements are one structure here, "
    "sections do not warp, drilling stiffness and normals of shells are those of the elements, and the mass is "
    "consistent unless mass = 'nastran'"
)


def unused(cards: Iterable[Card]) -> tuple[str, ...]:
    """Return the note on fields and parameters that are left out; empty without any.

    Examples
    --------
    >>> unused([Card("PARAM", ["G", ".02"], "a.bdf", 3)])[0][:39]
    'left out: 1 PARAM,G (a.bdf line 3); dam'
    """
    return left_out(((what, f"{card.file} line {card.line}") for card in cards for what in _of(card)), SAID_BESIDES)


def _of(card: Card) -> Iterator[str]:
    """Yield what a card says besides."""
    if card.name in GE and card.real(GE[card.name], "GE", 0.0):
        yield f"GE of {card.name}"
    if card.name == "GRID" and card.text(SEID) not in ("", "0"):
        yield "SEID of GRID"
    if card.name == "CBEAM" and any(card.fields[WARPING : WARPING + 2]):
        yield "SA and SB (warping) of CBEAM"
    if card.name == "PARAM" and card.text(0) in PARAMETERS and _asks_for_more(card):
        yield f"PARAM,{card.text(0)}"


def _asks_for_more(card: Card) -> bool:
    """Whether a parameter has another value than the one that asks for what the model has."""
    usual = PARAMETERS[card.text(0)]
    return bool(card.text(1)) if usual is None else real(card.text(1)) != usual
