"""How right a prediction is: tolerances of a robot carried through the solver as bands."""
