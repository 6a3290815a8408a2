"""What both sides must agree on: scene, interface, mapping, messages and the order of a step. Imports neither."""
