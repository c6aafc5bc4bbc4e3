"""The search for the variables that fulfil the wishes best."""
