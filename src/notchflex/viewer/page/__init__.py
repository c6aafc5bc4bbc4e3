"""What stands on the page: controls, charts, legend, readout."""
