"""What counts as a shear band and as a stable step: the same on both sides and in reports."""
