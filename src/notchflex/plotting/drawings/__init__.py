"""Drawings of a robot with its dimensions."""
