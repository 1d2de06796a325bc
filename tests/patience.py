"""How long tests wait for what must come. Nothing that is asserted depends on it: it ends a test that would hang."""

PATIENCE = 900.0  # seconds; the slowest wait takes 30 on two idle cores
