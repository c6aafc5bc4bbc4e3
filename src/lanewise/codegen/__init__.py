"""Generate LLVM IR from a lowered function."""
