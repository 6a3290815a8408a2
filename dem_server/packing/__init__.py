"""Filling of a window or a box with discs: radii, growth, front filling, files."""
