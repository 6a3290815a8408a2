"""Door to `colluvium.results.stones`, where scripts expect it."""

from colluvium.results.stones import *  # noqa: F403
