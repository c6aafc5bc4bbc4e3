"""Lower JAX's traces to nodes, loops and branches."""
