"""The grid: nets of quadrilaterals fitted to profiles, faces and holes, its sides and windows."""
