"""What a mesh shows of the part: its skin, openings and pins, plane faces."""
