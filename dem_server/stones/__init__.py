"""Irregular stones: polygons, where they lie, and the bodies of discs they become."""
