"""Pictures of tolerance analyses."""
