"""Factor of safety of a coupled slope: the strength of grid and discs is divided by the same factor."""
