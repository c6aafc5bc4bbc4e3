"""Results: equilibria and paths, the registry of quantities, tables and files."""
