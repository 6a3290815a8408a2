"""The report as one page: `player.write(run, path)`. Its JavaScript, CSS and HTML are data of this package."""
