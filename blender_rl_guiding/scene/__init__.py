"""What is rendered: the scene bundle, its camera, geometry and lights."""
