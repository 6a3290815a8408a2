"""LIGGGHTS (Debian: `apt-get install liggghts`): granular pairs with shear history.

Its public edition has no bonds that carry shear.
"""

import re

import numpy as np

from bench.peers.engine import RADII, WARM_UP, Outcome, behind, said_by, version_from
from bench.peers.lammps import data

NAME = "LIGGGHTS"
TRIAL = {False: {}}
DIFFERENCES = (
    "real time (velocity Verlet) instead of static mode; dashpots of the contacts, 20 % of critical, instead of local damping",
)

SCRIPT = """\
units si
dimension 2
newton {newton}
boundary f f p
atom_style granular
atom_modify map array sort {sort} 0.0
communicate single vel yes
neighbor {skin} bin
neigh_modify every 1 delay 0 check yes exclude type 2 2
read_data discs.data
fix young all property/global youngsModulus peratomtype 5e9 5e9
fix poisson all property/global poissonsRatio peratomtype 0.3 0.3
fix kn all property/global kn peratomtypepair 2 {kn} {kn} {kn} {kn}
fix kt all property/global kt peratomtypepair 2 {kt} {kt} {kt} {kt}
fix gn all property/global gamman peratomtypepair 2 {rate} {rate} {rate} {rate}
fix gt all property/global gammat peratomtypepair 2 {rate} {rate} {rate} {rate}
fix mu all property/global coefficientFriction peratomtypepair 2 {mu} {mu} {mu} {mu}
pair_style gran model hooke/stiffness tangential history
pair_coeff * *
group free type 1
fix motion free nve/sphere
fix plane all enforce2d
timestep {dt:.17g}
thermo_modify norm no lost error
run {warm_up}
run {steps}
dump last all custom 1 discs.out id x y vx vy fx fy
dump_modify last sort id format "%d %.17g %.17g %.17g %.17g %.17g %.17g"
run 0
"""


def version():
    """Release, or None."""
    return behind("Version", version_from(["liggghts", "-h"], "Version"))


def choices(bonded):
    """Settings worth trying; none with bonds."""
    return {} if bonded else {"newton": ["off", "on"], "skin": ["0.3", "0.1", "0.05"], "sort": ["1000", "0"]}


def run(box, steps, settings, trial=False):
    """Take `steps` steps; `trial`: undamped, from the trial's velocities."""
    rate = 0.0 if trial else box.viscosity() / (0.5 * box.mass[box.held :].mean())
    text = SCRIPT.format(
        newton=settings["newton"], skin=float(settings["skin"]) * RADII, sort=settings["sort"], kn=box.normal, kt=box.shear,
        rate=rate, mu=box.friction, dt=box.dt, steps=steps, warm_up=0 if trial else WARM_UP,
    )  # fmt: skip
    files = {"in.liggghts": text, "discs.data": data(box, trial, box.mass / (np.pi * box.radius**2))}  # discs in 2-D
    said, (found,) = said_by(["liggghts", "-in", "in.liggghts"], files, ["discs.out"], skip=9)
    loops = re.findall(r"Loop time of (\S+) on \d+ procs for (\d+) steps with (\d+) atoms", said)
    seconds = next(float(loop) for loop, taken, _ in reversed(loops) if int(taken) == steps)
    half_kick = 0.5 * box.dt * found[:, 5:7] / box.mass[:, None]
    half_kick[: box.held] = 0.0
    return Outcome(seconds / steps, found[:, 1:3], found[:, 3:5] - half_kick)
