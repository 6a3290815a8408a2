"""The discrete side: discs, contacts and contact bonds inside the window."""
