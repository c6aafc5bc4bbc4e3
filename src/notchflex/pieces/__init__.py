"""Long computations in pieces, one file each, by threads or dask; resumed after an interruption."""
