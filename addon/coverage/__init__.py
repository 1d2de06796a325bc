"""The coverage report: the list of losses, Check Scene, the panel, and the way from a line to the thing that it names."""
