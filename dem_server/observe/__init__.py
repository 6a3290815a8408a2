"""What is measured and recorded of the discs: energies, ratios, wall forces, stable limits."""
