"""One compiled program that solves loads for drives, and how it is called."""
