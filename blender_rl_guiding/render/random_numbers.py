"""Pairs of random numbers of a path. Every choice has a number of its own, so that each is stratified, and none depends on another."""

FILM, LENS = 0, 1  # of the camera
DIMENSIONS = 8  # that a vertex may use, after as many of the camera
PATH, EMITTER, LIGHT, DIRECTION, LOBE, PASSAGE = range(6)  # of a vertex:
# (is it recorded, does roulette end the path), (which emitter), where on it, wi, (which lobe, does it refract), (straight on, the guide's)
