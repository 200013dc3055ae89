"""Sizes that Python and compiled code agree on."""

WORD = 8  # bytes, of the block of a record
WIDTH = 4  # numbers in a lane
