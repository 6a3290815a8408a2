"""Measured and recorded quantities of the grid: fields, energies, stable limits."""
