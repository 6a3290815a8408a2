"""How discs fill a window or a box: radii, growth, front filling, files."""
