"""Error of a quantity against the time it costs, over settings of a scene: `colluvium accuracy`."""
