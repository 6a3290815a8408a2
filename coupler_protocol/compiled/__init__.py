"""Compilation, threads that share a step, and the words of memory by which they wait for each other."""
