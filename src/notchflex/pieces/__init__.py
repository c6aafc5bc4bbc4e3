"""Long computations in pieces, one file each, by threads or by workers of dask; gone on with."""
