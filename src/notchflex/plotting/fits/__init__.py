"""Pictures of comparisons, calibrations and the friction rig."""
