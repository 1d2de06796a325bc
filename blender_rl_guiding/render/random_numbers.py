"""The pairs of random numbers of a path, by dimension. Each choice uses its own number, so all choices are stratified and independent."""

FILM, LENS = 0, 1  # pairs of the camera: point in the pixel's filter, point on the lens
DIMENSIONS = 8  # pairs per vertex; the camera has the first 8
PATH, EMITTER, LIGHT, DIRECTION, LOBE, PASSAGE = range(6)  # pairs of a vertex:
# PATH: (record the vertex?, Russian roulette). EMITTER: both numbers together pick the emitter. LIGHT: point on the emitter.
# DIRECTION: wi. LOBE: (which lobe?, refract?). PASSAGE: (pass straight on?, the guide's third number for wi).
