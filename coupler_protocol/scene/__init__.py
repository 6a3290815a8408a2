"""The scene file: declared tables, the reader that reports all problems at once, stages in time."""
