"""Walls of a scene without a grid: made from `discs.wall`, changed by `stage.wall`, with histories under their names."""

import numpy as np

from coupler_protocol.problems import unfit
from coupler_protocol.scene.local_origin import in_the_scene
from coupler_protocol.scene.tables.discs import names_of_walls
from dem_server.step import servo
from dem_server.step.motion import SPEED_CAP
from dem_server.step.walls import make_walls


def walls_of(scene, model, state):
    """Walls of the State, or None without walls; they have servos if any wall has one in any stage."""
    tables = scene.discs.wall
    if not tables:
        return None
    ends = np.array([(*table.ends[0], *table.ends[1]) for table in tables])
    later = [table for stage in scene.stage for table in stage.wall]
    steered = any(table.servo is not None for table in [*tables, *later])
    walls = make_walls(ends, np.zeros((len(ends), 2)), model, servo.make_servo(ends, state.x) if steered else None)
    set_motions(walls, dict(enumerate(tables)))
    return walls


def any_moves(scene):
    """Whether any wall moves in any stage."""
    return any(table.moves for table in [*scene.discs.wall, *(table for stage in scene.stage for table in stage.wall)])


def set_motions(walls, tables):
    """Sets velocities or servos of walls from their tables {number: table}."""
    for w, table in tables.items():
        set_wall_motion(walls, w, table)
    if walls.servo is not None:
        for w in tables:
            servo.begin(walls, w)


def set_wall_motion(walls, w, table):
    """Sets the velocity or the servo of wall w from a table."""
    walls.velocity[w] = table.velocity
    if walls.servo is not None:
        walls.servo.pressure[w] = 0.0
    if table.servo is not None:
        steer = walls.servo
        steer.pressure[w], steer.fastest[w], steer.average[w] = table.servo.pressure, table.servo.fastest, table.servo.average


def begin_stage(scene, stage, model, state):
    """Changes walls by the tables of a stage; raises SceneError for a wall so fast that it could pass through discs."""
    names, walls = names_of_walls(scene.discs.wall), state.walls
    if stage.wall:
        set_motions(walls, {names.index(table.name): table for table in stage.wall})
    if walls is not None and walls.servo is not None:
        walls.servo.drift[:] = 0.0  # its unit depends on the kind of time
    if not stage.in_real_time and walls is not None and walls.servo is not None:
        speed, limit = np.where(walls.servo.pressure > 0.0, walls.servo.fastest, 0.0), SPEED_CAP * model.smallest_radius
        worst = int(speed.argmax())
        if speed[worst] > limit:
            why = f"in stage {stage.name!r} wall {names[worst]!r} may move by {speed[worst]:.3g} m a step, and pass through discs"
            raise unfit("discs.wall", why, f"at most {limit:.3g} m a step, a tenth of the smallest radius")


def histories(scene, walls, origin=(0.0, 0.0)):
    """Force on each wall and its middle, by the names of histories; origin [m]: the local origin of the walls."""
    found = {}
    for w, name in enumerate(names_of_walls(scene.discs.wall)):
        middle = in_the_scene(0.5 * (walls.ends[w, :2] + walls.ends[w, 2:]), origin)
        found |= {f"wall_force_x:{name}": walls.force[w, 0], f"wall_force_y:{name}": walls.force[w, 1]}
        found |= {f"wall_x:{name}": middle[0], f"wall_y:{name}": middle[1]}
    if walls.servo is not None:
        pressures = servo.pressures(walls)
        found |= {f"wall_pressure:{name}": p for name, p in zip(names_of_walls(scene.discs.wall), pressures, strict=True)}
    return {name: float(value) for name, value in found.items()}


def servo_error(walls):
    """Largest relative error of the pressures of all servos; 0 without servos."""
    return 0.0 if walls is None or walls.servo is None else servo.error(walls)
