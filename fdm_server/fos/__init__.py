"""Factors of safety: the factor on strength (or gravity) at which a slope fails."""
