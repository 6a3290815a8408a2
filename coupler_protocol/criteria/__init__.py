"""Criteria for shear bands, their states and stable steps: the same on both sides and in reports."""
