"""What a formatter leaves to people: one assignment a line, and no line that the formatter may not touch."""

import ast

PACKED = 80  # characters: a pair of short names or numbers reads as one thing, a longer one does not


def sources(project):
    return sorted((project / "src" / "modalprep").rglob("*.py"))


def packed(node):
    """Whether an assignment gives several values to several names in one line."""
    several = isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Tuple)
    return several and isinstance(node.value, ast.Tuple) and len(node.targets) == 1


def depends(node):
    """Whether the values of a packed assignment read what it assigns, as a swap does."""
    assigned = {name.id for name in ast.walk(node.targets[0]) if isinstance(name, ast.Name)}
    return bool(assigned & {name.id for name in ast.walk(node.value) if isinstance(name, ast.Name)})


def test_one_assignment_a_line(project):
    for file in sources(project):
        for node in ast.walk(ast.parse(file.read_text())):
            if packed(node) and not depends(node):
                short = len(ast.unparse(node)) <= PACKED + 4  # unparse adds brackets
                assert short, f"{file}:{node.lineno}: write one assignment a line"


def test_the_formatter_sees_every_line(project):
    for file in sources(project):
        if file.name != "dop853_table.py":  # the table as it is published
            assert "fmt: " not in file.read_text(), file
