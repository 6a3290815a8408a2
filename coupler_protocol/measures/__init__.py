"""Measures of discs in regions, and their sampling errors: the same in histories and in reports."""
