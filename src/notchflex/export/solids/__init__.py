"""Solids of a robot, straight as it is cut, or bent, in the frame of its base [mm]."""
