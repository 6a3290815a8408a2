"""Files of a run: VTKHDF frames and histories, checkpoints, run.json, discs as CSV."""
