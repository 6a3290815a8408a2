"""Finished runs opened again: fields, fabric, band, averages, export."""
