"""Much independent work, here or on a Dask cluster: each item done once, each result a file at once."""
