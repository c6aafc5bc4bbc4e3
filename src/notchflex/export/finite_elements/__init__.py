"""Decks of finite elements of notched tubes, for CalculiX."""
