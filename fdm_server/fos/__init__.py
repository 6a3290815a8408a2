"""Factors of safety: which factor on strength (or gravity) a slope just bears."""
