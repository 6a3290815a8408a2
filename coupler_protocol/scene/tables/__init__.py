"""Tables of a scene, one file a table."""
