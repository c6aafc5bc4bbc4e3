"""Kinds of notch, one file each, and the openings through which tendons enter a body."""
