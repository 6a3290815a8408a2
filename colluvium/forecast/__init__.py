"""Forecasts of a scene before its long run: check, step limits, band, factor of safety."""
