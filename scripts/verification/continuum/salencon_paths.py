"""Dependence of the Salencon wall on the path of its unloading: a picture and a paragraph for the page."""

from itertools import count

import numpy as np

from colluvium.figures.style import INK, styled
from verification.continuum import salencon_hole
from verification.continuum.holes import settle

PICTURE = "salencon_paths.png"
SIZE = 24
RAMPS = (1_000, 2_000, 5_000, 10_000, 20_000, 40_000, 80_000)
ACROSS = (14e6, 17e6, 20e6, 22.06e6, 24e6, 27e6, 30e6)
LINEAR, SLOWING, SUDDEN = "linear", "slowing down, (1 - s)²", "n sudden steps to ratio 1e-6"


def linear(s):
    """Share of the support that is left."""
    return 1.0 - s


def in_sudden_steps(parts):
    """The wall [m] relieved in equal sudden parts, each brought to rest, and the steps that took."""
    ring, load = salencon_hole.loaded(SIZE, parts, left=linear)
    steps = sum(settle(ring, 1e-6, lambda _, part=part: load(part)) for part in range(1, parts + 1))
    return steps, salencon_hole.wall(ring)


def by_ways():
    """{way: [(steps, wall [m])]} of the same hole."""
    ways = {LINEAR: [], SLOWING: [], SUDDEN: [in_sudden_steps(parts) for parts in (1, 2, 5, 10, 20, 50)]}
    for ramp in RAMPS:
        for name, left in ((LINEAR, linear), (SLOWING, lambda s: (1.0 - s) ** 2)):
            ring, steps = salencon_hole.solve(SIZE, ramp, left=left)
            ways[name].append((steps, salencon_hole.wall(ring)))
    return ways


def by_stress_across():
    """Wall [m] for each initial stress across the plane."""
    return [salencon_hole.wall(salencon_hole.solve(SIZE, 20_000, across)[0]) for across in ACROSS]


def by_size():
    """{zones to the right angle: wall [m]} relieved slowly."""
    return {n: salencon_hole.wall(salencon_hole.solve(n, 40_000)[0]) for n in (12, 24, 48)}


@styled
def draw(ways, across, path):
    """The walls of all ways, and of all initial stresses across the plane."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(7.4, 3.0), layout="constrained", sharey=True)
    for number, (name, points) in zip(count(), ways.items(), strict=False):
        steps, walls = np.array(points).T
        left.semilogx(steps, 1e3 * walls, marker="os^"[number], markersize=3.5, linewidth=1.1, label=name)
    left.set_xlabel("steps until the ground is at rest")
    left.set_ylabel("displacement of the wall [mm]")
    left.set_title(f"The way, initial stress across 20 MPa, {SIZE} zones to 90°")
    right.plot(np.array(ACROSS) / 1e6, 1e3 * np.array(across), marker="s", markersize=3.5, linewidth=1.1, color="C1")
    right.axvline(22.06, color="#a0a0a0", linewidth=0.8, linestyle=":")
    right.set_xlabel("initial stress across the plane [MPa]")
    right.set_title("The stress across, slowing down in 20,000 steps")
    for axes in (left, right):
        axes.axhline(1e3 * salencon_hole.wall_displacement(), color=INK, linewidth=0.8, linestyle="--", label="closed form")
    left.legend(fontsize=7.5)
    figure.savefig(path)
    plt.close(figure)


def study(pictures):
    """Draw the picture; returns what the page says about it."""
    ways, across, sizes = by_ways(), by_stress_across(), by_size()
    draw(ways, across, pictures / PICTURE)
    target = salencon_hole.wall_displacement()

    def off(wall):
        return f"{100.0 * (wall / target - 1.0):+.1f} %"

    worst = max(ways[LINEAR], key=lambda point: point[1])
    sudden, parts = ways[SUDDEN][0], max(ways[SUDDEN], key=lambda point: point[1])
    meshes = ", ".join(f"{n}: {off(wall)}" for n, wall in sizes.items())
    shifted = ", ".join(f"{stress / 1e6:g} MPa: {off(wall)}" for stress, wall in zip(ACROSS, across, strict=True))
    return f"""![The wall and the path of its unloading](pictures/{PICTURE})

The displacement of the wall depends on the path of its unloading. Plastic flow retains the displacement that the wall's momentum
adds. At the end of a linear ramp the wall still moves, and local damping removes nothing from a steady motion (it depends on the
unbalanced force, which is small then), so the wall overshoots and only the elastic part is recovered.
On {SIZE} zones to the right angle the error of the linear ramp
is up to {off(worst[1])} ({worst[0]:,} steps in total) and {off(ways[LINEAR][-1][1])} in
{ways[LINEAR][-1][0]:,}; one sudden unloading gives {off(sudden[1])}, several sudden ones up to {off(parts[1])}, because each
of them overshoots. A support that decreases as (1 - s)² brings the wall to rest together with the load:
{off(ways[SLOWING][4][1])} in {ways[SLOWING][4][0]:,} steps, {off(ways[SLOWING][-1][1])} in {ways[SLOWING][-1][0]:,}. The
remaining error is that of the mesh (zones to the right angle: {meshes}).

The initial stress across the plane also matters, because it decides whether rock flows out of the plane
(slowing down in 20,000 steps): {shifted}."""
