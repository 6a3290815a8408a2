"""Starting both sides of a run, as processes or threads, and showing their progress."""
