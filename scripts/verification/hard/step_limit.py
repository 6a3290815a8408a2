"""The longest stable step of grid and discs together, and steps of the code on both sides of it.

A box of 8 x 8 zones, all its sides held, with a window of 4 x 4 zones full of bonded discs; undamped and with local damping
alpha = 0.8. The assembled step has the highest frequency omega (Lanczos); masses are scaled by one factor such that the step
of 1 is a share of 2 / (omega sqrt(1 + alpha)). The motion starts in the mode of omega with a thousandth of noise on the discs:
at 0.99 of the limit, the largest speed must stay within five times that of the first steps, at 1.01 it must grow 1e5-fold.
"k/K": kn of a contact over K + 4G/3 of the zones; "R/zone": mean radius over zone size. The bound is the value of `colluvium
check` without `--exact`, over the exact limit."""

import numpy as np

from colluvium.forecast import linearised_step
from coupler_protocol.criteria.stable_step import highest
from dem_server.observe.stable_limit import safe_limit
from fdm_server.observe.stable_limit import safe_limits
from verification.hard.coupled_system import at_share, excite, growth, system
from verification.verdict_rows import row

NAME = "step limit"
STEPS = {True: 2_000, False: 100_000}  # by `fast`
SIZES = {True: (1 / 4, 1 / 8), False: (1 / 4, 1 / 8, 1 / 16, 1 / 32)}
STIFFNESSES = (0.1, 1.0, 1000.0)


def grown(stiffness, size, damping, share, steps):
    """Largest speed over that of the first steps at a share of the limit."""
    found, mode = at_share(system(stiffness, size, damping), share)
    excite(found, mode, 1e-9 * size, np.random.default_rng(0))
    return growth(found, steps)


def safe_share(found):
    """The safe limit of a system over its exact one."""
    (window,) = found.windows
    safe = safe_limits(found.model, found.state, window.nodes, found.state.added_mass[window.nodes])
    least = min(limit["share"] for limit in (*safe.values(), safe_limit(*window[1:])))
    return least / linearised_step.exact_limit(*found)["share"]


def rows(fast):
    """Full: 1e5 steps of every combination."""
    steps, sizes = STEPS[fast], SIZES[fast]
    span = f"R/zone 1/{1 / sizes[0]:.0f} to 1/{1 / sizes[-1]:.0f}"
    for damping in (0.0, 0.8):
        for stiffness in STIFFNESSES:
            name = f"alpha {damping:g}, k/K {stiffness:g}"
            below = max(grown(stiffness, size, damping, 0.99, steps) for size in sizes)
            yield row(
                f"{name}, {span}: largest growth of speed in {steps} steps at 0.99 of the limit", below, 0.0, 5.0, "bounded"
            )
            beyond = sum(grown(stiffness, size, damping, 1.01, 500) >= 1e5 for size in sizes)
            yield row(f"{name}, {span}: systems that grow 1e5 fold at 1.01", beyond, len(sizes), 0.0, "all")
            least = min(safe_share(system(stiffness, size, damping)) for size in sizes)
            yield row(f"{name}, {span}: smallest safe limit over the exact one", least, 1.0, [-0.5, 0.0], "a bound")


def measured_share(stiffness, size, damping):
    """Longest stable step over the limit, by bisection with the code's own steps."""
    low, high = 0.9, 1.1
    while high - low > 0.002:
        middle = 0.5 * (low + high)
        if grown(stiffness, size, damping, middle, 1500) < 100.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def study(pictures):
    """Measured stable step over the predicted one, and the step with and without the mass rule, against k/K."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    ratios, size = 10.0 ** np.arange(-2.0, 4.5, 0.5), 1 / 4
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    for damping, mark in ((0.0, "o"), (0.8, "s")):
        left.semilogx(ratios, [measured_share(k, size, damping) for k in ratios], mark, mfc="none", label=f"alpha = {damping:g}")
        with_rule, without = zip(*(limits_by_rule(k, size, damping) for k in ratios), strict=True)
        (line,) = right.loglog(ratios, with_rule, "-", label=f"with the mass rule, alpha = {damping:g}")
        right.loglog(ratios, without, "--", color=line.get_color(), label=f"without, alpha = {damping:g}")
    left.axhline(1.0, color="0.6", lw=0.8)
    left.set(xlabel="k/K [-]", ylabel="measured over predicted stable step [-]", ylim=(0.95, 1.05))
    right.axhline(1.0, color="0.6", lw=0.8)
    right.set(xlabel="k/K [-]", ylabel="stable step over the step taken [-]")
    left.legend(frameon=False)
    right.legend(frameon=False)
    figure.savefig(pictures / "step_limit.png", dpi=110)
    pyplot.close(figure)
    return "![Measured over predicted stable step, and the stable step with and without the mass rule](pictures/step_limit.png)"


def limits_by_rule(stiffness, size, damping):
    """The exact limit over the step taken with the mass rule and without."""
    found = system(stiffness, size, damping)
    K, mass = linearised_step.operator(*found)
    bare = mass.copy()
    bare[: 2 * len(found.state.added_mass)] -= np.repeat(found.state.added_mass / (1.0 + damping), 2)
    return 2.0 / np.sqrt(highest(K, mass)[0]), 2.0 / np.sqrt(highest(K, bare)[0])
