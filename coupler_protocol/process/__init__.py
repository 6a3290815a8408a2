"""Command line, signals, progress, plugins and trace of every process."""
