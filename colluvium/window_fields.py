"""Door to `colluvium.results.window_fields`, where scripts expect it."""

from colluvium.results.window_fields import *  # noqa: F403
