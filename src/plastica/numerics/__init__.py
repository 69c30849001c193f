"""Grids on the unit interval: nodes, weights, integration and interpolation."""
