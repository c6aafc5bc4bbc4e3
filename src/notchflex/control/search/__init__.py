"""The search for drives that meet one target."""
