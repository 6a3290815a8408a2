"""What the benchmarks of this project share, and their cases."""
