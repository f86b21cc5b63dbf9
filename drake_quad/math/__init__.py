"""Rotations, curves, distances and polygons; there is no robot in them."""
