"""Other engines on our dense boxes, one file each; engine.py says what such a file offers."""

from bench.peers import lammps, liggghts, yade

ENGINES = (lammps, liggghts, yade)
