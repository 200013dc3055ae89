"""The page of a study: a row for each job, with filters, sorting and a plot."""
