"""The page: controls, charts, legend, readout."""
