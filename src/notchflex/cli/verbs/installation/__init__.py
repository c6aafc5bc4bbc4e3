"""Verbs about the installation: its speed, its state, completion in the shell."""
