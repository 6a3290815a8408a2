"""Definitions that both sides share: scene, interface, mapping, messages and the order of a step. Imports neither side."""
