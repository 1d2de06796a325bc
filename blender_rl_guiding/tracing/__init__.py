"""The scene as kernels see it: rays from the camera, and where they hit."""
