"""Represent programs between JAX's trace and LLVM: nodes over lanes, loops and branches."""
