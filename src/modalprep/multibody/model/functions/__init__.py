"""What functions of time are made of: expressions, curves through points, how short their events may be."""
