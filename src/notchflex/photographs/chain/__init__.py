"""The projected chain: poses of the bodies, the camera, and the outline that it sees."""
