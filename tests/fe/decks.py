"""Cards that many small Nastran decks share."""

STEEL = "MAT1,7,2.+11,,.3,8000.\n"
GRIDS = "GRID,1,,0.,0.,0.\nGRID,2,,2.,0.,0.\nGRID,3,,2.,1.,0.\nGRID,4,,0.,1.,0.\n"
BAR = "CBAR,9,5,1,2,0.,1.,0.\n"
PBAR = "PBAR,5,7,.01,3.-6,2.-6,4.-6\n"


def free(card, large=False):
    """Write a card in free field."""
    name, *values = card
    per_line = 4 if large else 8
    lines = [values[i : i + per_line] for i in range(0, len(values), per_line)]
    return "".join(",".join([(name if i == 0 else "") + "*" * large, *line]) + "\n" for i, line in enumerate(lines))
