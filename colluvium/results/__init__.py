"""Results of runs: fields, fabric, band, averages, export."""
