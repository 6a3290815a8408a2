"""The one place that compiles, threads that share a step, words of memory they wait at."""
