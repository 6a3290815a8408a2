"""Growth of the discs of a packing, ring held, to a stress or a porosity.

Servo to a stress: every 200 steps, until the mean stress is the target, all radii change as an affine deformation would need,

    dr/r = 2 A dp / sum(kn d^2)                                               (1)

(A: area, dp: missing mean stress, d: distance of centres). While the stress is too low, discs with fewer than
three contacts grow by 1 %, so that few stay loose, in the first SWELLING rounds only: among stiff discs 1 % of a radius is many
times the overlap at the target, and a single loose disc that closes its gap carries the stress beyond it again and again. The
servo ends when the discs are at rest at that stress. Stiff discs under a small stress have few more contacts than they need, and
rearrange for more than a hundred growths.

To a porosity n: all radii change by one factor

    f^2 = (A (1 - n) - ring) / sum pi r^2                                     (2)

in rounds of 1 % at most (ring: inner shares of the control discs), so the porosity is exact. In the first rounds discs with
fewer than three contacts grow by 1 % before Eq (2) shrinks the others. The stress follows. Discs without mutual support at this
porosity are loose. Discs that would overlap by a tenth of their radius are refused: linear springs are not valid there.
"""

import numpy as np

from coupler_protocol.interface.ring import inner_share
from coupler_protocol.problems import unfit
from dem_server.model import RADIUS
from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces
from dem_server.step.cycle import advance
from dem_server.step.neighbours import rebuild

STEPS = 200  # between two growths
ROUNDS = 100  # at most, to a porosity
GROWTHS = 300  # at most, to a stress
SWELLING = 40  # of them in which loose discs grow more
LONGER = 4  # times as many steps in a round after them: stiff discs with few contacts each come to rest slowly
LARGEST = 0.01  # largest growth of a radius in one round
ACCURACY = 0.01  # of the confining stress
TOLD = 50  # steps between calls of a report: a few seconds in the largest windows
CALM = 5e-4  # mean resultant over mean force at the end; friction, which is added later, stops the remaining creep
FILLING = 12  # rounds at the target porosity in which loose discs grow
LOOSE = 1e-6  # mean stress over contact stiffness below which discs are loose
DEEPEST = 0.1  # largest mean overlap over mean radius


def run(model, state, steps, report=None):
    """Takes `steps` steps without gravity; report(share): called every TOLD steps with the share of the steps that is done."""
    for done in range(0, steps, TOLD):
        if report:
            report(done / steps)
        advance(model, state, 0.0, min(TOLD, steps - done))


def pressure(pairs, area):
    """Mean pressure of contacts `pairs` in a window of `area` [m2] (Pa)."""
    return float(pairs.normal_force @ np.hypot(*pairs.branch.T)) / (2.0 * area)


def to_stress(model, state, area, target, report):
    """Changes radii, Eq (1), until the discs are at rest at the mean stress `target` [Pa]; raises ArithmeticError otherwise."""
    for round_ in range(GROWTHS):
        pairs = contacts(state)
        length = np.hypot(*pairs.branch.T)
        stress = pressure(pairs, area)
        if report:
            report(f"mean stress {stress / 1e3:.1f} of {target / 1e3:.1f} kPa", 0.4 + 0.6 * round_ / GROWTHS)
        if abs(target - stress) > ACCURACY * target:
            stiffness = model.law.spring.normal[pairs.kind] @ length**2
            growth = 2.0 * area * (target - stress) / stiffness if len(length) else LARGEST
            grow(model, state, pairs, np.clip(growth, -LARGEST, LARGEST), round_ < SWELLING)
        elif unrest(model, state, pairs) < CALM:
            return
        run(model, state, STEPS if round_ < SWELLING else LONGER * STEPS)
    raise ArithmeticError(
        f"the packing is at {stress:.0f} Pa instead of {target:.0f} Pa after {GROWTHS} growths: "
        "a higher discs.confinement or more discs are easier to bring to rest"
    )


def to_porosity(model, state, area, wanted, report):
    """Changes radii, Eq (2), until the discs are at rest at the porosity `wanted`; returns whether they are loose."""
    rounds_there = 0
    for round_ in range(ROUNDS):
        pairs = contacts(state)
        stress = pressure(pairs, area)
        if report:
            report(f"porosity {wanted:g}, mean stress {stress / 1e3:.1f} kPa", 0.4 + 0.6 * round_ / ROUNDS)
        refuse_squeezed(model, state, pairs, wanted)
        if rounds_there < FILLING:
            if scale_to(model, state, area, wanted) == 1.0:
                rounds_there += 1
                swell_loose(model, state, pairs)
                scale_to(model, state, area, wanted)
            rebuild(model, state)
            contact_forces(model, state)
        elif stress < LOOSE * model.law.spring.normal.max():
            return True
        elif unrest(model, state, pairs) < CALM:
            return False
        run(model, state, STEPS)
    raise ArithmeticError(
        f"the discs are not at rest at a porosity of {wanted:g} after {ROUNDS} rounds (mean stress {stress:.0f} Pa): "
        "they hardly hold each other; choose a lower discs.porosity, or a higher one for loose discs"
    )


def scale_to(model, state, area, wanted):
    """Scales the free radii by Eq (2), by LARGEST at most; returns the share of the factor that remains."""
    solid = np.pi * state.radius**2
    ring = float(solid[: model.ring] @ inner_share(state.x[: model.ring]))
    factor = ((area * (1.0 - wanted) - ring) / float(solid[model.ring :].sum())) ** 0.5
    step = min(max(factor, 1.0 - LARGEST), 1.0 + LARGEST)
    state.disc[model.ring :, RADIUS] *= step
    return factor / step


def refuse_squeezed(model, state, pairs, wanted):
    """Raises SceneError for discs that overlap by more than DEEPEST of their mean radius on average."""
    if not len(pairs.gap):
        return
    radius = float(state.radius[model.ring :].mean())
    overlap = -float(pairs.gap.mean())
    if overlap > DEEPEST * radius:
        first = -np.sort(pairs.gap)[: 2 * (model.count - model.ring)].mean()  # contacts there were at first: four a disc
        apart = 1.0 - (1.0 - wanted) * (1.0 - 0.5 * first / radius) ** 2
        why = f"discs would overlap by {100.0 * overlap / radius:.0f} % of their radius on average to reach {wanted:g}"
        raise unfit("discs.porosity", why, f"choose a higher one: discs that just touch are at about {apart:.2f}")


def unrest(model, state, pairs):
    """Mean resultant over mean sum of forces on the free discs [-]; a few loose discs do not dominate it."""
    resultant = np.hypot(*state.force[model.ring :].T).sum()
    return resultant / (2.0 * pairs.normal_force.sum())


def grow(model, state, pairs, growth, swelling=True):
    """Changes the radii of the free discs by the share `growth`; if it is positive, and `swelling`, loose discs grow more."""
    state.disc[model.ring :, RADIUS] *= 1.0 + growth
    if growth > 0.0 and swelling:
        swell_loose(model, state, pairs)
    rebuild(model, state)
    contact_forces(model, state)


def swell_loose(model, state, pairs):
    """Grows free discs with fewer than three contacts."""
    number = np.bincount(np.concatenate([pairs.disc_a, pairs.disc_b]), minlength=model.count)
    loose = (np.arange(model.count) >= model.ring) & (number < 3)
    state.disc[loose, RADIUS] *= 1.0 + LARGEST
