"""Messages between the two sides: content, bytes, links and turns."""
