"""What acts on the ground and changes it: boundaries, loads, initial stress, excavation, removed zones."""
