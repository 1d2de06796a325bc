"""Rays in kernels: from the camera, and their hits with the scene's triangles."""
