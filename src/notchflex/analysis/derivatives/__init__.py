"""Derivatives of results by loads and by numbers of the robot file."""
