"""Guided rendering experiments: an Embree-based path tracer with a deep-Q-network guide."""

__version__ = "0.1.0"
