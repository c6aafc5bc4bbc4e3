"""Pictures of control."""
