"""The specification of a design: the file, its checks and its schema."""
