"""Pictures of a run, one file for each subject: `missing(run)` names the data that a run lacks, `draw(run)` draws."""
