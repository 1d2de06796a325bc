"""What shines: emitting triangles, lamps and the world; choosing one of them, and the pdf of having chosen it."""
