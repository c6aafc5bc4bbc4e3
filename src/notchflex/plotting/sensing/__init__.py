"""Pictures of sensed forces."""
