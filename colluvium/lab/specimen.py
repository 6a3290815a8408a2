"""Samples of the tests: outline of the packing, and walls around it, with their motion in the press and in the test.

Lengths count in mean radii R of the discs. Discs touch the inner side of the ring of control discs in which they are packed,
which is between 0.73 R and R inside of the outline; walls begin at INSIDE. They are smooth, and reach beyond the corners where
they move.
"""

from math import asin, cos, pi, sin
from typing import Any, NamedTuple

KINDS = ("shear", "biaxial", "oedometer", "brazilian")
INSIDE = 0.75  # radii from the outline to the walls
BEYOND = 6.0  # radii by which walls reach farther beyond a corner than the displacement of a shear box at a strain of 0.5
BOX = 0.6  # height over width of a shear box
CUP = 0.5  # height over width of an oedometer
FLAT = pi / 18.0  # half angle of the flat ends of a Brazilian disc, 10 degrees
SIDES = 48  # of its outline
FASTEST = 2e-3  # radii a step: largest speed of a servo wall

Line = tuple[tuple[float, float], tuple[float, float]]


class Wall(NamedTuple):
    """A wall: its ends [m], whether a servo presses with it, and its motion in the test as shares (x, y) of the test's speed.

    keeps: the servo acts in the test, too.
    """

    ends: Line
    presses: bool = False
    moves: tuple[float, float] = (0.0, 0.0)
    keeps: bool = False


class Specimen(NamedTuple):
    """A sample: outline of the packing (P, 2) [m], its walls by name; width, height [m] between the walls."""

    outline: list[tuple[float, float]]
    walls: dict[str, Wall]
    width: float
    height: float


def specimen(kind: str, radius: float, lab: Any) -> Specimen:
    """The sample of a test with discs of the mean `radius` [m]; lab: the scene's table."""
    width = lab.width * radius
    if kind == "brazilian":
        return _disc(width, radius)
    height = {"biaxial": lab.slenderness, "shear": BOX, "oedometer": CUP}[kind] * width
    make = {"biaxial": _biaxial, "shear": _shear_box, "oedometer": _oedometer}[kind]
    inside, beyond = INSIDE * radius, BEYOND * radius + 0.5 * BOX * width
    walls = make((inside, inside), (width - inside, height - inside), beyond)
    return Specimen(_rectangle(width, height), walls, width - 2.0 * inside, height - 2.0 * inside)


def _rectangle(width: float, height: float) -> list[tuple[float, float]]:
    return [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]


def _biaxial(low: tuple[float, float], high: tuple[float, float], beyond: float) -> dict[str, Wall]:
    """Four walls with servos; in the test the upper one moves down and the sides keep their pressure."""
    (x0, y0), (x1, y1) = low, high
    return {
        "bottom": Wall(((x0 - beyond, y0), (x1 + beyond, y0))),
        "top": Wall(((x0 - beyond, y1), (x1 + beyond, y1)), presses=True, moves=(0.0, -1.0)),
        "left": Wall(((x0, y0 - beyond), (x0, y1 + beyond)), presses=True, keeps=True),
        "right": Wall(((x1, y0 - beyond), (x1, y1 + beyond)), presses=True, keeps=True),
    }


def _oedometer(low: tuple[float, float], high: tuple[float, float], beyond: float) -> dict[str, Wall]:
    """Sides and floor that never move; the upper wall presses, then moves down, then up again."""
    walls = _biaxial(low, high, beyond)
    return {name: wall if name == "top" else Wall(wall.ends) for name, wall in walls.items()}


def _shear_box(low: tuple[float, float], high: tuple[float, float], beyond: float) -> dict[str, Wall]:
    """An upper and a lower half, which moves to the right; wings close the halves where they no longer face each other."""
    (x0, y0), (x1, y1) = low, high
    middle, right = 0.5 * (y0 + y1), (1.0, 0.0)
    return {
        "bottom": Wall(((x0, y0), (x1, y0)), moves=right),
        "lower_left": Wall(((x0, y0), (x0, middle)), moves=right),
        "lower_right": Wall(((x1, y0), (x1, middle)), moves=right),
        "lower_wing": Wall(((x0 - beyond, middle), (x0, middle)), moves=right),
        "upper_left": Wall(((x0, middle), (x0, y1 + beyond))),
        "upper_right": Wall(((x1, middle), (x1, y1 + beyond))),
        "upper_wing": Wall(((x1, middle), (x1 + beyond, middle))),
        "top": Wall(((x0 - beyond, y1), (x1 + beyond, y1)), presses=True, keeps=True),
    }


def _disc(width: float, radius: float) -> Specimen:
    """A disc with flat ends between two plates, which come to it lightly once it is bonded; then the upper one moves."""
    r, half = 0.5 * width, 0.5 * width * sin(FLAT)
    level = r * cos(FLAT)
    ends = asin(level / r)
    arc = [-ends + 2.0 * ends * k / SIDES for k in range(SIDES + 1)]
    outline = [(r * cos(a), r * sin(a)) for a in arc] + [(-r * cos(a), -r * sin(a)) for a in arc]
    plate = half + 4.0 * radius
    walls = {
        "bottom": Wall(((-plate, -level), (plate, -level)), presses=True),
        "top": Wall(((-plate, level), (plate, level)), presses=True, moves=(0.0, -1.0)),
    }
    return Specimen(outline, walls, width, 2.0 * level)
