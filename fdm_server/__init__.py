"""The continuum: explicit Lagrangian finite differences on quadrilateral and triangular zones."""
