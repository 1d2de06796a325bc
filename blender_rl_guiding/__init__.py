"""Experiments with guided rendering: a path tracer on Embree, with guides that learn, such as a deep Q network."""

__version__ = "0.1.0"
