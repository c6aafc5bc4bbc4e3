"""Flat patterns: the outer surface of the tube unrolled, with the cuts on it."""
