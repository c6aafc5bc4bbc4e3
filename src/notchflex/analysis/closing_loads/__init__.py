"""Loads and angles at which notches close."""
