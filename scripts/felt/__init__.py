"""Parts of scripts/window_felt.py: levels of gravity, numbers of each level, tables and pictures."""
