"""Stages of a scene on the side of the discs, coupled or alone."""
