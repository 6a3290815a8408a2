"""One step of the discs: neighbour list, contacts, motion, clumps, walls, in compiled code."""
