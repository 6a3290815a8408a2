"""Boundaries, loads, initial stress, excavations and removed zones of the ground."""
