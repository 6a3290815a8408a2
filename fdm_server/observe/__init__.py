"""What is measured and recorded of the grid: fields, energies, stable limits."""
