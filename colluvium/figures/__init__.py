"""Pictures of a run, one subject a file: `applies(run)` tells whether its data exist, `draw(run)` draws."""
