"""Guided rendering experiments: an Embree-based path tracer with guides that learn, a deep Q network among them."""

__version__ = "0.1.0"
