"""Which quantity, at which state, which entry, within which limits: in files, Python and words."""
