"""Tells what came out of an experiment, from its folder alone. Knows nothing of rendering."""
