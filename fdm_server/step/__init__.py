"""One step of the grid: strain, stress, forces and motion, in compiled code."""
