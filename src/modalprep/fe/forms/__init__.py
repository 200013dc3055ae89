"""Every element family as scikit-fem: meshes, elements, bases and weak forms; and the compiled loops as forms."""
