"""Search for parameters of discs that give a target soil: `colluvium calibrate SCENE`."""
