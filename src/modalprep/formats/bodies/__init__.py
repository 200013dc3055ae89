"""Bodies that files of other programs describe."""
