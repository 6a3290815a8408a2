"""Every quantity in the files of a run: name, unit and long name.

Names are stable: other programs read them. An array whose name is not in a table here cannot be recorded, so
no number is in a file without a unit. The step of static stages is 1, so there "s" counts steps.
"""

from typing import NamedTuple


class Quantity(NamedTuple):
    """Attributes of a dataset: unit, long name and components of its numbers."""

    unit: str
    long_name: str
    components: tuple[str, ...] = ()


_PLANE, _TENSOR = ("x", "y"), ("xx", "yy", "zz", "xy")

FIELDS = {
    # gridpoints and discs
    "displacement": Quantity("m", "displacement since it was last set to zero", _PLANE),
    "velocity": Quantity("m/s", "velocity", _PLANE),
    # zones
    "stress": Quantity("Pa", "stress, tension positive", _TENSOR),
    "shear_strain_rate": Quantity("1/s", "maximum engineering shear strain rate"),
    "shear_strain": Quantity("-", "maximum engineering shear strain"),
    "plastic_state": Quantity("-", "yielding: 1 shear now, 2 tension now, 4 shear past, 8 tension past (sum)"),
    "plastic_shear_strain": Quantity("-", "plastic shear strain: half the engineering shear angle in plane shear"),
    "group": Quantity("-", "index of the zone's material in the scene"),
    # discs
    "id": Quantity("-", "number of the disc, the same in every frame"),
    "radius": Quantity("m", "radius"),
    "spin": Quantity("rad/s", "angular velocity, counter-clockwise positive"),
    "material": Quantity("-", "material of the disc: 0 control disc, 1 soil, 2 stone"),
    "stone": Quantity("-", "number of the stone the disc belongs to, -1 for soil"),
    "centroid": Quantity("m", "centroid of the rigid body the disc belongs to, or its own centre", _PLANE),
    "control": Quantity("-", "1 for a control disc of the ring, 0 for a free disc"),
    "wall_force": Quantity("N", "force of all walls on the disc per unit thickness", _PLANE),
    "wall_virial": Quantity("N m", "sum of wall forces times the way from the body's centroid to the wall", _TENSOR),
    # contacts
    "disc_a": Quantity("-", "id of the first disc of the contact"),
    "disc_b": Quantity("-", "id of the second disc of the contact"),
    "normal_force": Quantity("N", "normal contact force per unit thickness, compression positive"),
    "shear_force": Quantity("N", "shear contact force per unit thickness on the second disc, along (-n_y, n_x)"),
    "bond_state": Quantity("-", "0 never bonded, 1 bonded, 2 broken in tension, 3 broken in shear"),
    "rolling_moment": Quantity("N m", "moment of rolling resistance on the second disc, counter-clockwise positive"),
    "parallel_bond_state": Quantity("-", "parallel bond: 0 never bonded, 1 bonded, 2 broken in tension, 3 broken in shear"),
    "parallel_bond_normal_force": Quantity("N", "force of the parallel bond, compression positive, part of normal_force"),
    "parallel_bond_shear_force": Quantity("N", "shear force of the parallel bond on the second disc, part of shear_force"),
    "parallel_bond_moment": Quantity("N m", "bending moment of the parallel bond on the second disc"),
}

FRAME = {
    "step": Quantity("-", "number of the step"),
    "time": Quantity("s", "time; static stages advance it by 1 a step"),
    "stage": Quantity("-", "name of the stage"),
    "gravity_factor": Quantity("-", "gravity over the gravity of the scene"),
}

CRACKS = {
    "step": Quantity("-", "number of the step of the first look (point of the histories, frame) after the break"),
    "time": Quantity("s", "time of that step; static stages advance it by 1 a step"),
    "place": Quantity("m", "point of contact of the two discs", _PLANE),
    "normal": Quantity("-", "unit vector from the first to the second disc, normal to the crack", _PLANE),
    "size": Quantity("m", "diameter of the smaller disc"),
    "disc_a": Quantity("-", "id of the first disc"),
    "disc_b": Quantity("-", "id of the second disc"),
    "material_a": Quantity("-", "material of the first disc: 0 control disc, 1 soil, 2 stone"),
    "material_b": Quantity("-", "material of the second disc"),
    "mode": Quantity("-", "2 broken in tension, 3 broken in shear, as bond_state"),
    "bond": Quantity("-", "0 contact bond, 1 parallel bond"),
}

CONSTANTS = {
    "stone_corners": Quantity("m", "corners of the stones as they were placed, one stone behind the other", _PLANE),
    "stone_start": Quantity("-", "row of each stone's first corner, and one past the last corner"),
    "window_surface": Quantity("m", "ground surface of the window from its last to its first control disc, at its start", _PLANE),
}

_REGION = "a region; its name stands after a colon"
_OF_REGIONS = {
    **{f"stress_{part}": ("Pa", f"mean stress {part}, tension positive, of the discs in") for part in ("xx", "yy", "xy")},
    "porosity": ("-", "porosity of"),
    "coordination": ("-", "mean number of contacts of the bodies in"),
    "mechanical_coordination": ("-", "mean number of contacts of the bodies with at least two contacts in"),
    "sliding": ("-", "share of the contacts at the friction limit in"),
    **{f"strain_rate_{part}": ("1/s", f"strain rate {part}, best fit to the discs in") for part in ("xx", "yy", "xy")},
}

HISTORIES = {
    "time": Quantity("s", "time, in stages that compute in real time"),
    "unbalanced_ratio": Quantity("-", "unbalanced force ratio"),
    "gravity_factor": Quantity("-", "gravity over the gravity of the scene"),
    "kinetic_energy": Quantity("J", "kinetic energy per unit thickness"),
    "energy_kinetic": Quantity("J", "kinetic energy of the grid at whole steps, of the velocities before and after"),
    "energy_strain": Quantity("J", "elastic energy of the grid"),
    "energy_plastic": Quantity("J", "work on plastic strain since the stage began"),
    "energy_averaging": Quantity("J", "work on averages of volumetric strain at gridpoints since the stage began"),
    "energy_damping": Quantity("J", "work lost to damping since the stage began"),
    "energy_external": Quantity("J", "work of applied forces and driven gridpoints since the stage began"),
    "energy_dashpots": Quantity("J", "work of the dashpots of quiet sides, or of contacts, lost since the stage began"),
    "energy_arriving": Quantity("J", "work of waves that arrive at compliant sides since the stage began"),
    "energy_shape": Quantity("J", "work of stresses on the change of areas in large strain since the stage began"),
    "energy_gravity": Quantity("J", "work of weights since the stage began"),
    "energy_error": Quantity("J", "what the ledger of energies does not explain"),
    "energy_stored": Quantity("J", "energy stored in the contacts of a window's discs"),
    "energy_friction": Quantity("J", "work of contacts on slip and rolling since the stage began"),
    "energy_bonds": Quantity("J", "work lost in pairs whose bonds broke since the stage began"),
    "energy_masses": Quantity("J", "kinetic energy that scaled masses took along as they changed since the stage began"),
    "energy_ring": Quantity("J", "work of the control discs on the others since the stage began"),
    "interface_power": Quantity("W", "power of the discs' forces in the velocities of the step that follows"),
    "interface_work": Quantity("J", "the interface's power times the step, summed since the stage began"),
    "elastic_energy": Quantity("J", "energy stored in the contacts of discs per unit thickness"),
    "weight_energy": Quantity("J", "energy of the discs' weight above y = 0 (or `computed_about`) per unit thickness"),
    "wall_force_x": Quantity("N", "sum of the discs' forces on the walls, x; of one wall, its name stands after a colon"),
    "wall_force_y": Quantity("N", "sum of the discs' forces on the walls, y; of one wall, its name stands after a colon"),
    "wall_x": Quantity("m", "middle of a wall, x; its name stands after a colon"),
    "wall_y": Quantity("m", "middle of a wall, y; its name stands after a colon"),
    "wall_pressure": Quantity("Pa", "pressure of the discs on a wall, where any wall has a servo; its name stands after a colon"),
    "strain_xx": Quantity("-", "mean strain of the discs between moving walls since the start, xx, tension positive"),
    "strain_yy": Quantity("-", "mean strain of the discs between moving walls since the start, yy, tension positive"),
    "strain_xy": Quantity("-", "mean strain of the discs between moving walls since the start, xy"),
    "interface_force_x": Quantity("N", "sum of the discs' forces on the rim, x"),
    "interface_force_y": Quantity("N", "sum of the discs' forces on the rim, y"),
    "max_displacement": Quantity("m", "largest displacement"),
    "reaction_x": Quantity("N", "force of a boundary on the ground per unit thickness, x; its name stands after a colon"),
    "reaction_y": Quantity("N", "force of a boundary on the ground per unit thickness, y; its name stands after a colon"),
    "moved_x": Quantity("m", "mean displacement of the gridpoints that a boundary moves, x; its name stands after a colon"),
    "moved_y": Quantity("m", "mean displacement of the gridpoints that a boundary moves, y; its name stands after a colon"),
    "bodies": Quantity("-", f"discs and clumps with their centroid in {_REGION}"),
    **{
        name + end: Quantity(unit, f"{'standard error of the ' if end else ''}{what} {_REGION}")
        for name, (unit, what) in _OF_REGIONS.items()
        for end in ("", "_error")
    },
    "bonds_broken": Quantity("-", "contact bonds broken since the start"),
    "velocity_caps": Quantity("-", "times the velocity of a disc was capped since the start"),
}


PER_STEP = {  # units of rates in static stages, whose step is 1 and not a second
    "m/s": "m per step",
    "rad/s": "rad per step",
    "1/s": "1 per step",
    "W": "J per step",
    "s": "steps",
}


def quantity(table: dict[str, Quantity], name: str) -> Quantity:
    """Entry of `name` up to a colon; raises an error with the known names and the file where a new one is declared."""
    try:
        return table[name.partition(":")[0]]
    except KeyError:
        raise ValueError(
            f"no unit is known for {name!r}. Known: {', '.join(sorted(table))}. "
            f"A new quantity is declared in coupler_protocol/files/quantities.py."
        ) from None


def declare_field(name: str, unit: str, long_name: str) -> None:
    """Declares unit and long name of a law's history; a name that is already in FIELDS keeps its own."""
    FIELDS.setdefault(name, Quantity(unit, long_name))
