"""Sections of the report page of a body; each is a title, an anchor, and HTML that is made in a file of its own."""
