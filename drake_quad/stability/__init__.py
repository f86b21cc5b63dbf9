"""Margins of a stance: regions of equilibrium, margins in motion, and pushes it can take."""
