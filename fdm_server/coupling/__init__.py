"""Windows on the side of the grid: rims, messages to and from the discs, the common step, watches."""
