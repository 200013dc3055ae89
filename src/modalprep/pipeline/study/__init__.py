"""The result of a batch as one table: what each job states, in files for other programs and on a page."""
