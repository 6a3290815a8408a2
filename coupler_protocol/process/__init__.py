"""What every process does beside computing: command line, signals, progress, plugins, trace."""
