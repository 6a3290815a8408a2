"""The scene file: declared tables, the reader that finds every problem at once, stages in time."""
