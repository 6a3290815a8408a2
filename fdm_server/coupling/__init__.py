"""Windows seen from the grid: rims, the talk with the discs, the common step, watches."""
