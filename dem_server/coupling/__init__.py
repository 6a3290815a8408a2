"""Interface of a window to the grid: control discs of the ring, their springs, guard and strain."""
