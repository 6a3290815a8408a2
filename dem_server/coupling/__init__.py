"""The window seen from the grid: control discs of the ring, their springs, guard and strain."""
