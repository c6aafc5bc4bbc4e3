"""The engine of sweeps: manifest, folder, pieces, and who works on them."""
