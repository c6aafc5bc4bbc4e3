"""What a design is asked for: the file, its checks and its schema."""
