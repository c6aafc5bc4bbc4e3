"""Kinds of friction, one file each."""
