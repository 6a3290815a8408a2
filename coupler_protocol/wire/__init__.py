"""Messages between the two sides: what is said, as bytes, over which link, and whose turn it is."""
