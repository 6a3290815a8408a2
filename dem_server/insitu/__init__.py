"""Stress of the removed zones brought into a packing."""
