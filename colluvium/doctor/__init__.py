"""`colluvium doctor`: whether a machine can compute, and reach the other side of a run."""
