"""Pictures of a run, one subject a file: `missing(run)` says what a run lacks for it, `draw(run)` draws."""
