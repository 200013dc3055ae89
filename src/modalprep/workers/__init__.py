"""Workers that run the jobs of a task: threads, local processes, or a Dask cluster.

Light to import: a worker process sets its threads before numpy is loaded.
"""
