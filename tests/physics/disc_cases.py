"""Small arrangements of discs for tests of physical laws: those of the verification."""

from verification.discrete.discs import KN, KS, MU, displace, loose_discs, soil_discs, with_held

__all__ = ["KN", "KS", "MU", "displace", "loose_discs", "soil_discs", "with_held"]
