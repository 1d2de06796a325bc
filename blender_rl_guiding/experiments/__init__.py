"""Runs experiments, and saves their results in folders."""
