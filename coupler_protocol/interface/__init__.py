"""Geometry of the rim between zones and discs, and the mapping of velocities and forces across the rim."""
