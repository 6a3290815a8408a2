"""What accuracy costs: one workload a file, each error against wall time."""
