"""The questions of `notchflex new`."""
