"""Robots and states as a function of the variables of a design, with exact derivatives."""
