"""Stress averaged over the contacts is the stress on the walls.

Scenes: discs of a mean radius of 0.04 m fill a rectangle of 1 m by 0.8 m, and four walls 0.04 m inside its edges hold them
under pressure until the unbalanced force ratio is 1e-8, with local damping: smooth, with friction 0.55, and with friction and
rigid stones (discs of 0.03 m). The walls are smooth, so those opposite each other carry the same force. The force of the discs
on a wall over the wall's length against `run.average_stress`: over all contacts, those with walls included, force times branch
between the centroids of the bodies (Weber 1966):

    sigma = -(1/A) sum sym(F (x) l)

At rest, forces balance at every centroid, so friction, its moments and stones change nothing: in the sum F (x) x over
the points of contact, inner points cancel and the faces of the walls remain. Branches between the discs of a stone instead of
its centroid omit the stress inside the stone: the last row gives the amount.
"""

import numpy as np
import shapely

from verification.discrete import scenes
from verification.verdict_rows import row

NAME = "box"
WIDTH, HEIGHT, INSIDE = 1.0, 0.8, 0.04  # of the window, and of the walls inside it [m]
LEFT, RIGHT, LOW, HIGH = INSIDE, WIDTH - INSIDE, INSIDE, HEIGHT - INSIDE
CORNERS = [[LEFT, LOW], [RIGHT, LOW], [RIGHT, HIGH], [LEFT, HIGH]]
WALLS = [{"ends": [CORNERS[i], CORNERS[(i + 1) % 4]]} for i in range(4)]
OUTLINE = [[0.0, 0.0], [WIDTH, 0.0], [WIDTH, HEIGHT], [0.0, HEIGHT]]
SIZE = {"mean": 0.16, "sigma": 0.15, "min": 0.12, "max": 0.22}


def box(friction=True, stones=False):
    """Tables of the scene."""
    soil = dict(scenes.SOIL)
    if not friction:
        del soil["friction"]
    discs = {"radius": 0.04, "confinement": 1e5, "soil": soil, "wall": WALLS, "damping": {"local": 0.7}}
    more = {"window": [{"name": "box", "polygon": OUTLINE}], "ring": {"spring": soil["spring"]}}
    if stones:
        discs["stone"] = soil | {"density": 2700.0}
        more["stones"] = {"content": 0.3, "gap": 0.02, "size": SIZE}
        discs["radius"] = 0.03
    rest = {"name": "rest", "kind": "discs", "until": {"ratio": 1e-8, "steps": 200_000}}
    return scenes.tables([rest], discs, every=10**9, **more)


def averaged(scene):
    """Stress [Pa] between the walls; forces on bottom, right, top, left [N]; ratio; yy by the discs' branches [Pa]."""
    with scenes.of_tables(scene) as run:
        discs, ratio = run.discs(-1), run.info["stages"][1]["ratio_discrete"][0]
        sides = [discs.xy[:, 1] < LOW + discs.radius, discs.xy[:, 0] > RIGHT - discs.radius]
        sides += [discs.xy[:, 1] > HIGH - discs.radius, discs.xy[:, 0] < LEFT + discs.radius]
        if not shapely.contains_xy(shapely.Polygon(CORNERS), discs.xy).all():
            raise ArithmeticError("a disc is not between the walls")
        normal = [1, 0, 1, 0]
        force = [-discs.wall_force[side, k].sum() if side.any() else 0.0 for side, k in zip(sides, normal, strict=True)]
        return run.average_stress(-1, CORNERS), force, ratio, by_discs(run)


def by_discs(run):
    """Stress yy [Pa] from the contacts between discs with the branches of the discs, those inside a stone left out."""
    discs, contacts = run.discs(-1), run.contacts(-1)
    branch = np.diff(discs.xy[contacts.ends], axis=1)[:, 0]
    normal = branch / np.hypot(*branch.T)[:, None]
    force = contacts.normal_force * normal[:, 1]
    if "shear_force" in contacts:
        force = force + contacts.shear_force * normal[:, 0]
    walls = discs.wall_force[:, 1] * np.where(discs.xy[:, 1] < 0.5 * HEIGHT, LOW - discs.xy[:, 1], HIGH - discs.xy[:, 1])
    return (walls.sum() - force @ branch[:, 1]) / ((RIGHT - LEFT) * (HIGH - LOW))


def rows(fast):
    """Three scenes, in seconds each."""
    source = "Weber (1966), Bull. Liaison Ponts et Chaussees 20"
    kinds = (("smooth", False, False), ("friction", True, False), ("friction and stones", True, True))
    for words, friction, stones in kinds:
        (xx, yy, _), (bottom, right, top, left), ratio, without = averaged(box(friction, stones))
        yield row(f"{words}: unbalanced force ratio", ratio, 0.0, 1e-8, "as asked for")
        walls = (("xx", xx, "right", -right, HIGH - LOW), ("xx", xx, "left", left, HIGH - LOW))
        walls += (("yy", yy, "top", -top, RIGHT - LEFT), ("yy", yy, "bottom", bottom, RIGHT - LEFT))
        for part, mean, side, force, length in walls:
            yield row(f"{words}: averaged stress {part} against the {side} wall [Pa]", mean, force / length, 1e-6, source)
        if stones:
            words = "yy with branches between discs over yy with those between centroids"
            yield row(words, without / yy, 1.0, [-0.6, -0.01], "what the stones carry")
