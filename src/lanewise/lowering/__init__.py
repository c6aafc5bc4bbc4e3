"""From JAX's trace to the graph of statements."""
