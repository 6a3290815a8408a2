"""Start of both sides of a run, as processes or threads, and display of their progress."""
