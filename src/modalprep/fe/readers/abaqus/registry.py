"""What the reader does with each keyword of Abaqus and CalculiX."""

from __future__ import annotations

from modalprep.fe.readers.abaqus import (
    analysis,
    beams,
    constraints,
    cyclic,
    elements,
    geometry,
    materials,
    points,
    sections,
    sets,
    superelements,
    ties,
)
from modalprep.fe.readers.coverage import Entry

PROCEDURES = (
    "STATIC",
    "BUCKLE",
    "DYNAMIC",
    "MODAL DYNAMIC",
    "STEADY STATE DYNAMICS",
    "SUBSTRUCTURE GENERATE",
    "SUBSTRUCTURE MATRIX OUTPUT",
    "SELECT EIGENMODES",
    "MATRIX GENERATE",
    "MATRIX OUTPUT",
    "VISCO",
)
TYPES_OF_USERS = {
    "USER ELEMENT": Entry(
        "read",
        "LINEAR, with its *MATRIX, and CalculiX' beam U1; subroutines and FILE are refused.",
        superelements.user_element,
    ),
    "MATRIX": Entry("read", "Stiffness and mass of a linear user element.", superelements.matrix),
    "MATRIX INPUT": Entry("read", "Symmetric, as text, also by INPUT.", superelements.matrix_input),
}
GEOMETRY = {
    "SYSTEM": Entry("read", "", geometry.system),
    "NODE": Entry("read", "SYSTEM R, C and S. Directions of normals in the lines are left out.", geometry.nodes),
    "NGEN": Entry("read", "On lines, arcs (LINE=C) and parabolas (LINE=P).", geometry.ngen),
    "NFILL": Entry("read", "Without BIAS and SINGULAR.", geometry.nfill),
    "NCOPY": Entry("read", "With SHIFT.", geometry.ncopy),
    "ELEMENT": Entry("read", "By its TYPE, see below.", elements.elements),
    "ELGEN": Entry("read", "", elements.elgen),
    "ELCOPY": Entry("read", "Without REFLECT.", elements.elcopy),
    "NSET": Entry("read", "A set is a group of vertices.", sets.node_or_element_set),
    "ELSET": Entry("read", "A set is a group of cells.", sets.node_or_element_set),
    "SURFACE": Entry("read", "Of faces or nodes, for couplings and ties.", sets.surface),
}
MATERIALS = {
    "MATERIAL": Entry("read", "", materials.material),
    "ELASTIC": Entry(
        "read",
        "ISOTROPIC, ENGINEERING CONSTANTS, ORTHOTROPIC, of solids ANISOTROPIC, of shells LAMINA. Of temperatures the "
        "first holds.",
        materials.elastic,
    ),
    "DAMPING": Entry("read", "For modalprep init, where all materials have the same.", materials.damping),
    "DENSITY": Entry("read", "Of temperatures the first holds.", materials.density),
    "DISTRIBUTION": Entry("read", "Of coordinates for *ORIENTATION.", materials.distribution),
    "NODAL THICKNESS": Entry("read", "At every node of a section that asks for it.", sections.nodal_thickness),
    "TRANSVERSE SHEAR STIFFNESS": Entry("read", "Of beams, without slenderness compensation.", beams.transverse_shear),
}
AXES = {
    "ORIENTATION": Entry("read", "By coordinates or a distribution.", materials.orientation),
    "TRANSFORM": Entry("read", "For supports, equations and springs.", materials.transform),
    "NORMAL": Entry(
        "approximated",
        "Axis 2 of beams of Abaqus, the mean of the nodes of an element; left out with a note for shells and CalculiX.",
        beams.normal,
    ),
}
SECTIONS = {
    "SOLID SECTION": Entry("read", "Of volumes and trusses.", sections.solid_section),
    "SHELL SECTION": Entry(
        "read", "Also COMPOSITE, OFFSET, ORIENTATION; CalculiX expands shells to solids.", sections.shell_section
    ),
    "SHELL GENERAL SECTION": Entry("read", "By material, not by stiffnesses.", sections.shell_section),
    "BEAM SECTION": Entry(
        "approximated",
        "By shape, with Abaqus' shear factors and torsion of thin walls, without warping. The node of L is taken to be "
        "where the middles of its legs meet. CalculiX expands beams to solids. SECTION=CIRC, GENERAL, OFFSET1, OFFSET2 "
        "and NODAL THICKNESS are as in CalculiX' manual; the thickness is one for all nodes of a section.",
        beams.beam_section,
    ),
    "BEAM GENERAL SECTION": Entry("read", "GENERAL and by shape; warping is left out.", beams.beam_general_section),
    "MASS": Entry("read", "", points.mass),
    "ROTARY INERTIA": Entry("read", "", points.rotary_inertia),
    "SPRING": Entry("read", "Linear; SPRING2 in one component for both nodes.", points.spring),
    "DASHPOT": Entry("read", "Linear ones.", points.dashpot),
}
MATRICES = {
    "MATRIX ASSEMBLE": Entry(
        "read",
        "Of Abaqus by STIFFNESS, MASS and NSET, of CalculiX by STIFFNESS FILE and MASS FILE; damping is left out with "
        "a note.",
        superelements.matrix_assemble,
    ),
    "UEL PROPERTY": Entry("read", "Of linear user elements; their damping is left out.", superelements.uel_property),
}
CONSTRAINTS = {
    "TIE": Entry(
        "approximated",
        "Each node of the slave surface follows the master face next to it, onto which it moves; with ADJUST=NO it "
        "stays, and its gap turns with the face. With CYCLIC SYMMETRY it names the edges of a sector.",
        ties.tie,
    ),
    "CYCLIC SYMMETRY MODEL": Entry(
        "read", "For [cyclic]; its edges are the sets cyclic_low, cyclic_high.", cyclic.cyclic_model
    ),
    "COUPLING": Entry("read", "", constraints.coupling),
    "KINEMATIC": Entry("read", "", constraints.kinematic),
    "DISTRIBUTING": Entry("read", "Weighted by the area of faces; nodes alike.", constraints.distributing),
    "KINEMATIC COUPLING": Entry("read", "", constraints.kinematic_coupling),
    "DISTRIBUTING COUPLING": Entry("read", "Of an element DCOUP3D, with weights.", constraints.distributing_coupling),
    "RIGID BODY": Entry(
        "read", "Displacements of CalculiX' ROT NODE are rotations of the reference node.", constraints.rigid_body
    ),
    "MPC": Entry(
        "read",
        "BEAM, TIE, PIN, LINK; MEANROT that measures a rotation, while one that holds it is refused.",
        constraints.mpc,
    ),
    "PRE-TENSION SECTION": Entry(
        "approximated", "The section is closed, as after tightening; its force does not act.", constraints.pretension
    ),
    "EQUATION": Entry("read", "", constraints.equation),
    "INITIAL CONDITIONS": Entry("no effect", "Stresses are left out with a note.", analysis.initial_conditions),
    "BOUNDARY": Entry(
        "read", "Before the steps and in the first, as supports; a displacement is held at zero.", constraints.boundary
    ),
}
WITHOUT_EFFECT = {  # parameters: names, and what counts in other analyses
    "NAME",
    "CONSTRAINT NAME",
    "CONTROLS",
    "DEPENDENCIES",
    "DESCRIPTION",
    "INSTANCE",
    "INTERNAL",
    "UNSORTED",
    "TEMPERATURE",
    "POISSON",
    "SECTION INTEGRATION",
    "AMPLITUDE",
    "FIXED",
    "LOAD CASE",
    "NGRAPH",
}
IN_STEPS = {
    "FREQUENCY": Entry("read", "Count and band of modes, for modalprep init.", analysis.frequency),
    "CLOAD": Entry("read", "A load of the mesh with the name of its step, for [loads].", analysis.point_load),
    "DLOAD": Entry("read", "Pressures are loads of the mesh; gravity is for modalprep init.", analysis.element_load),
    "DSLOAD": Entry("read", "Pressures are loads of the mesh.", analysis.surface_load),
    "MODAL DAMPING": Entry(
        "read", "For modalprep init, where it is one for all modes or given over the frequency.", analysis.modal_damping
    ),
    "GLOBAL DAMPING": Entry("read", "For modalprep init.", analysis.global_damping),
    "RETAINED NODAL DOFS": Entry("read", "A group of this name, for interfaces of modalprep init.", analysis.retained),
}
STAGES = (TYPES_OF_USERS, GEOMETRY, MATERIALS, AXES, SECTIONS, MATRICES, CONSTRAINTS)

STRUCTURE = dict.fromkeys(
    ("INCLUDE", "PART", "END PART", "INSTANCE", "END INSTANCE", "ASSEMBLY", "END ASSEMBLY"), Entry("read")
)
STEPS = {
    "STEP": Entry("no effect", "Supports of the first step count; static loads are those of the step alone."),
    **IN_STEPS,
    **{
        name: Entry("no effect", "Loads in time and at frequencies come from the pipeline file.") for name in PROCEDURES
    },
    "END STEP": Entry("no effect"),
    "SELECT CYCLIC SYMMETRY MODES": Entry("no effect", "Nodal diameters come from [cyclic]."),
    "MODEL CHANGE": Entry("refused", "It removes elements in a step; give the deck of the state that is meant."),
}
NO_EFFECT = dict.fromkeys(
    (
        "HEADING",
        "PREPRINT",
        "RESTART",
        "FILE FORMAT",
        "USER OUTPUT VARIABLES",
        "PARAMETER CHECK",
        "PHYSICAL CONSTANTS",
        "VALUES AT INFINITY",
        "AMPLITUDE",
        "TIME POINTS",
        "FILTER",
        "SURFACE INTERACTION",
        "SURFACE BEHAVIOR",
        "FRICTION",
        "CONTACT CONTROLS",
        "SECTION CONTROLS",
        "HOURGLASS STIFFNESS",
        "SECTION POINTS",
        "DISTRIBUTION TABLE",
        "EXPANSION",
        "CONDUCTIVITY",
        "SPECIFIC HEAT",
        "LATENT HEAT",
        "PLASTIC",
        "CYCLIC HARDENING",
        "CREEP",
        "RATE DEPENDENT",
        "DAMAGE INITIATION",
        "DAMAGE EVOLUTION",
        "SHEAR FAILURE",
        "TENSILE FAILURE",
        "FAIL STRESS",
        "FAIL STRAIN",
        "DEPVAR",
        "ELECTRICAL CONDUCTIVITY",
        "PIEZOELECTRIC",
        "RADIATE",
        "FILM PROPERTY",
        "SPECIFIC GAS CONSTANT",
        "FLUID CONSTANTS",
        "NODE PRINT",
        "NODE FILE",
        "EL PRINT",
        "EL FILE",
        "NODE OUTPUT",
        "ELEMENT OUTPUT",
        "OUTPUT",
        "PRINT",
        "MONITOR",
        "CONTACT FILE",
    ),
    Entry("no effect"),
)
REFUSED = {
    keyword: Entry("refused", remark)
    for remark, keywords in {
        "It carries stiffness that has no counterpart here.": (
            "HYPERELASTIC",
            "HYPERFOAM",
            "VISCOELASTIC",
            "HYPOELASTIC",
            "POROUS ELASTIC",
            "USER MATERIAL",
            "NO COMPRESSION",
            "NO TENSION",
            "MEMBRANE SECTION",
            "COHESIVE SECTION",
            "GASKET SECTION",
            "SURFACE SECTION",
            "FRAME SECTION",
            "REBAR",
            "REBAR LAYER",
            "CONNECTOR SECTION",
            "CONNECTOR BEHAVIOR",
            "CONNECTOR ELASTICITY",
            "USER SECTION",
            "BUSHING",
            "FLUID SECTION",
            "ACOUSTIC MEDIUM",
            "JOINT",
            "GAP",
            "FOUNDATION",
            "JOINTED MATERIAL",
            "BEAM ADDED INERTIA",
            "CENTROID",
            "SHEAR CENTER",
            "SHELL TO SOLID COUPLING",
        ),
        "A substructure is read as [body] file, or as a linear *USER ELEMENT with *MATRIX.": ("SUBSTRUCTURE PROPERTY",),
        "It carries mass that has no counterpart here.": ("NONSTRUCTURAL MASS", "FIXED MASS SCALING"),
        "It carries constraints that have no counterpart here.": (
            "CONTACT PAIR",
            "CONTACT",
            "CONTACT INCLUSIONS",
            "CONTACT PROPERTY ASSIGNMENT",
            "CLEARANCE",
            "EMBEDDED ELEMENT",
            "RELEASE",
            "FASTENER",
            "FASTENER PROPERTY",
            "DISPLAY BODY",
            "RIGID SURFACE",
        ),
        "It moves or makes nodes in a way that is not read; list them.": ("NMAP", "IMPERFECTION"),
        "It depends on parameters; write their values.": ("PARAMETER",),
    }.items()
    for keyword in keywords
}
TYPES = {f"ELEMENT, TYPE={name}": known.entry for name, known in elements.TYPES.items()}
TYPES |= {f"ELEMENT, TYPE={name}": Entry("refused", why) for name, (_, why) in elements.WITHOUT_COUNTERPART.items()}

REGISTRY: dict[str, Entry] = {
    **TYPES_OF_USERS,
    **MATRICES,
    **GEOMETRY,
    **MATERIALS,
    **AXES,
    **SECTIONS,
    **CONSTRAINTS,
    **STRUCTURE,
    **STEPS,
    **REFUSED,
    **TYPES,
    **NO_EFFECT,
}
