"""Accuracy of predictions: tolerances of a robot carried through the solver as bands."""
