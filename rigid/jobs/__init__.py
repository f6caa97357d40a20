"""Independent jobs, here or on the workers of a Dask scheduler."""
