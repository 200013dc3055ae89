"""Ansys input: archives of CDWRITE (.cdb) and commands (.ans)."""
