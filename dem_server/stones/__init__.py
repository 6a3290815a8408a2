"""Irregular stones: polygons, their positions, and the bodies of discs that represent them."""
