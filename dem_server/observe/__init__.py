"""Measured and recorded quantities of the discs: energies, ratios, wall forces, stable limits."""
