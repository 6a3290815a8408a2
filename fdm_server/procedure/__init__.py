"""Stages of a scene as the grid conducts them."""
