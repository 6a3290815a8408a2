"""What a scene will do before the long run: check, step limits, band, factor of safety."""
