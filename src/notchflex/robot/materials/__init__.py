"""Kinds of material, one file each."""
