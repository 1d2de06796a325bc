"""From a depsgraph in render mode to the scene bundle, one file a kind of thing."""
