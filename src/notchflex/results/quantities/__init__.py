"""Quantities of results: the registry of names, symbols and units, and their formulas."""
