"""The model at every measured row, and its residuals."""
