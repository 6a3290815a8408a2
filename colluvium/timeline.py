"""Door to `colluvium.results.timeline`, where scripts expect it."""

from colluvium.results.timeline import *  # noqa: F403
