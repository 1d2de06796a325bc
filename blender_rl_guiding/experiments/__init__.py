"""Experiments: what is compared, how it is run, and what is told about it."""
