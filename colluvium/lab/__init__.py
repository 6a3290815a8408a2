"""Laboratory tests of a scene's discs: `colluvium lab KIND SCENE`."""
