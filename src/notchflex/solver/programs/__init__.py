"""Compiled programs: their arguments, how they are made, kept, and run."""
