"""The time limit that ends a test that would hang. No assertion depends on it."""

PATIENCE = 900.0  # seconds; the slowest wait takes 30 on two idle cores
