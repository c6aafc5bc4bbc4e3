"""The robot in space: meshes, colours, marks, camera."""
