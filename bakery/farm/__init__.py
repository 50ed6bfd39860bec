"""Many bakes on other people's engines: job files that they read, tasks on a dask cluster."""
