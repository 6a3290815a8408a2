"""Stages of a scene as the discs go through them, coupled or alone."""
