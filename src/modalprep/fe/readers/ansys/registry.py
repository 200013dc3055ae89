"""What the reader does with each command of Ansys input files."""

from __future__ import annotations

from modalprep.fe.readers.ansys import analysis
from modalprep.fe.readers.ansys import handlers as h
from modalprep.fe.readers.ansys.commands import FIRST
from modalprep.fe.readers.ansys.cyclic import cyclic
from modalprep.fe.readers.ansys.elements import ELEMENTS
from modalprep.fe.readers.coverage import Entry

MADE = "It makes what the file does not list; export the model by CDWRITE."
JOINED = "It makes constraint equations from the model; export the model by CDWRITE, which lists them."
CHANGED = "It changes what stands before it; export the model by CDWRITE, which lists what is left."
CHOSEN = "It chooses or repeats commands; export the model by CDWRITE."
VALUES = "They depend on other files or on parameters; give the numbers."
QUIET = (
    "/PREP7 /SOLU /POST1 /NOPR /GO /GOPR /TITLE /BATCH /CLEAR /FILNAME /UNITS /SHOW /VIEW /ANGLE /DIST /OUTPUT /WB "
    "/CONFIG /PNUM /NUMBER /REPLOT /AUTO /FCOMP /NERR /EXIT /DELETE /GST /STATUS *SET *MSG *GET *DEL *ELSE *ENDIF "
    "FINISH SAVE SOLVE NUMOFF NUMCMP DOF ANTYPE MXPAND EQSLV QRDOPT MODCONTROL EXTOPT TREF BFUNIF TUNIF CGLOC "
    "IRLF ERESX CRPLIM NCNV NEQIT TIME KUSE MPTEMP SHPP OUTRES OUTPR KBC NSUBST DELTIM AUTOTS CNVTOL NLGEOM "
    "RESCONTROL IC LSWRITE LSSOLVE CMGRP CMEDIT KEYW DMPOPTION WPSTYLE K L A V RATE HARFRQ MPAMOD MPDRES MPLIB SELTOL "
    "ETCONTROL ESTIF TOFFST STABILIZE SSTIF RESP GRID PSD CUTCONTROL SBCTRAN CSCIR CSDELE CSLIST DSYS RSYS TBTEMP"
)
UNREAD = (
    "OMEGA DOMEGA CGOMEGA DCGOMG CMOMEGA CMDOMEGA CMACEL CORIOLIS FDELE "
    "SFEDELE SF SFE SFL SFA SFBEAM BF BFE MDAMP SFGRAD"
)
GENERATING = (
    "NGEN FILL NSYM NSCALE NROTAT NMODIF EGEN EMODIF ENGEN ENSYM ESYM EINTF EMESH AMESH VMESH LMESH VSWEEP VEXT VDRAG "
    "ESURF EREFINE CS CSKP CSWPLA TRANSFER"
)
UNDOING = "DDELE CEDELE CPDELE NDELE EDELE MPCHG MPDELE EKILL ENDRELEASE DSYM"

COMMANDS: dict[str, Entry] = {
    "NBLOCK": Entry("read", "Nodes with their coordinates; angles turn supports and couplings.", h.nblock),
    "N": Entry("read", "", h.node),
    "EBLOCK": Entry("read", "", h.eblock),
    "E": Entry("read", "", h.element),
    "EN": Entry("read", "", h.element),
    "EMORE": Entry("read", "", h.emore),
    **{name: Entry("read", "", h.attribute) for name in ("TYPE", "MAT", "REAL", "SECNUM", "ESYS")},
    "ET": Entry("read", "", h.element_type),
    "ETBLOCK": Entry("read", "", h.type_block),
    "KEYOPT": Entry("read", "Of the integration those of SOLID186 and SOLID95 are used.", h.option),
    "MP": Entry("approximated", "Of a polynomial in the temperature the constant is taken.", h.material),
    "MPDATA": Entry("approximated", "Of several temperatures the first is taken.", h.material_data),
    "TB": Entry("approximated", "ELASTIC (isotropic) and ANEL are read, nonlinear tables are left out.", h.table),
    "TBDATA": Entry("approximated", "That of elastic tables is read.", h.table_data),
    "R": Entry("read", "", h.reals),
    "RMORE": Entry("read", "", h.more_reals),
    "RLBLOCK": Entry("read", "", h.real_block),
    "SECTYPE": Entry(
        "read", "Shells, beams by RECT, CSOLID, CTUBE, HREC, I and ASEC, pipes and links.", h.section_type
    ),
    "SECDATA": Entry("read", "", h.section_data),
    "SECBLOCK": Entry("read", "", h.section_block),
    "SECOFFSET": Entry("read", "", h.section_offset),
    "SECCONTROL": Entry("approximated", "Shear stiffness and added mass are refused.", h.section_control),
    "CMBLOCK": Entry("read", "A component becomes a group of its name.", h.component),
    "CM": Entry("approximated", "Read after ALLSEL, and after ESEL,NONE or NSEL,NONE with what follows.", h.named),
    **dict.fromkeys("NSEL ESEL ALLSEL CMSEL ESLN ESLA NSLE".split(), Entry("read", "For CM.", h.selection)),
    "LUMPM": Entry("approximated", "The mass is consistent also where Ansys lumps it.", h.lumped),
    "LOCAL": Entry(
        "read",
        "Cartesian, cylindrical and spherical systems, for elements (ESYS), beside the predefined 1, 2, 5 and 6.",
        h.local,
    ),
    "CSYS": Entry("read", "Only the global Cartesian system.", h.active_system),
    "*IF": Entry("read", "The switch that CDWRITE writes; others are refused.", h.switch),
    "D": Entry("read", "A set of supports and a group, both of the name 'held'.", h.support),
    "CE": Entry("read", "Its constant is left out.", h.equation),
    "CP": Entry("read", "", h.couple),
    "F": Entry("read", f"The load {analysis.LOAD!r} of the mesh, for [loads].", analysis.force),
    "M": Entry("read", f"The group {analysis.MASTER!r}, for interfaces of modalprep init.", analysis.master),
    **{
        name: Entry("read", "For modalprep init: count and band of modes, damping, gravity.", analysis.analysis)
        for name in ("MODOPT", "ACEL", "ALPHAD", "BETAD", "DMPRAT", "DMPSTR")
    },
    "PSTRES": Entry("no effect", "Modes are those of the unloaded structure, as init says.", analysis.prestressed),
    **dict.fromkeys(UNREAD.split(), Entry("no effect", "modalprep init says so.", analysis.unread)),
    "CYCLIC": Entry(
        "read",
        "With its number of sectors, for [cyclic]; its components are the groups cyclic_low, cyclic_high.",
        cyclic,
    ),
    "CYCOPT": Entry("no effect", "Nodal diameters come from [cyclic]."),
    **dict.fromkeys(QUIET.split(), Entry("no effect")),
    **dict.fromkeys(GENERATING.split(), Entry("refused", MADE)),
    **dict.fromkeys(UNDOING.split(), Entry("refused", CHANGED)),
    **dict.fromkeys("CERIG RBE3 CEINTF CPINTF CEGEN CPGEN CPCYC CECYC CPLGEN".split(), Entry("refused", JOINED)),
    **dict.fromkeys("*DO *DOWHILE *REPEAT *USE /INPUT CDREAD USE".split(), Entry("refused", CHOSEN)),
    **dict.fromkeys("SECREAD SECFUNCTION SSPA SSPB SSPD SSPE SSMT".split(), Entry("refused", VALUES)),
}
BY_LETTERS: dict[str, str] = {}
for _name in COMMANDS:
    BY_LETTERS.setdefault(_name[: FIRST + (_name[0] in "/*")], _name)
REGISTRY: dict[str, Entry] = COMMANDS | ELEMENTS
