"""The scene as data: bundle, camera, geometry, lights and shaders. Blender's Python imports this."""
