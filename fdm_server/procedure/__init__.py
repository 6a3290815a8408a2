"""Stages of a scene on the side of the grid, which conducts them."""
