"""Stairs from depth images: cameras and their errors, the belief, the search and the fit."""
