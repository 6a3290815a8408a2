"""The grid: nets of quadrilaterals fitted to profiles, faces and holes, and the sides and windows of the grid."""
