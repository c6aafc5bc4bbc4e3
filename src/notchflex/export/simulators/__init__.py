"""Models of robots for simulators of rigid bodies: MJCF, URDF and a transmission table."""
