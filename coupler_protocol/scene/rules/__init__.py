"""Rules that need more than one table of a scene, by topic."""
