"""Rules and doubts about a scene that need the grid."""
