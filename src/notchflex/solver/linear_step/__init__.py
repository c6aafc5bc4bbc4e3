"""Newton's linear step: rows of every element, eliminated along the chain."""
