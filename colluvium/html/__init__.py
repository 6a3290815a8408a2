"""The report as one page: `player.write(run, path)`. Its JavaScript, style and frame are data of this package."""
