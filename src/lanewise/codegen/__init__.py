"""From the graph to LLVM's text."""
