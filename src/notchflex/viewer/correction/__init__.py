"""A page in the browser on which fits to photographs are corrected by hand."""
