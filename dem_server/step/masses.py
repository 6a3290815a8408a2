"""Masses and time step. Static mode: dt = 1, and each disc gets the mass for which its springs are stable.

    m = k / sf^2,   k = max(sum kn nx^2 + ks ny^2,  sum kn ny^2 + ks nx^2)      (1)
    I = sum(ks r^2 + kr) / sf^2                                                  (2)

The sums run over all listed pairs, also those that do not touch, so every contact that can close before the
next list is built is counted. The worst case is a single contact with ks = kn, two discs sliding and rolling
on each other: omega^2 = 4 sf^2. In packings it is 2 to 3 sf^2 (largest eigenvalue). A step is stable for
omega^2 <= 4 / (1 + alpha) with local damping alpha, hence

    sf = min(0.75, 0.98 / sqrt(1 + alpha)).                                      (3)

Dashpots act with the velocity half a step earlier, which is stable if M >= dt C / 2 + dt^2 K / 4; body by body

    m >= c dt + k (dt / sf)^2,   c = sum max(cn, 2 cs);   I likewise with sum 2 cs r^2    (4)

(a pair's mass is at most the body's, so in static mode c <= c' sqrt(m), sqrt(m) = (c' + sqrt(c'^2 + 4 k / sf^2)) / 2).

Real time: masses and inertia are those of the weight, and the step is the largest that fulfils (4) for all free
bodies with tau in place of dt / sf, times the fraction `Model.real_time`:

    dt = sf min tau,   tau = (-c + sqrt(c^2 + 4 k m)) / 2k = sqrt(m / k) without dashpots.     (5)

Within a stage it only decreases. Gravity acts on the real mass (`State.weight`) in both modes. Sources: Underwood
(1983), Dynamic relaxation, in: Computational Methods for Transient Analysis, ch. 5; Itasca, PFC2D 3.1 Theory,
"Determination of the critical timestep" and "Density scaling".
"""

import numpy as np

from dem_server.model import INERTIA, MASS
from dem_server.step.stiffness import set_pair_masses, sums


def safety(damping):
    """Safety factor sf of Eq (3) [-]; `damping`: the law's DampingTable or None."""
    alpha = 0.0 if damping is None else damping.local
    return min(0.75, 0.98 / (1.0 + alpha) ** 0.5)


def set_masses(model, state):
    """Sets mass and inertia of all discs and clumps, and in real time the step, from the listed pairs."""
    if not model.in_real_time:
        set_static_masses(model, state)
        set_pair_masses(model, state)
    else:
        set_real_masses(model, state)
        set_pair_masses(model, state)
        state.next_dt = min(state.next_dt, model.real_time * stable_step(model, state))


def set_static_masses(model, state):
    """Sets masses by Eqs (1), (2) and (4). A disc or clump without pairs gets the mass for one spring; I >= m r^2 / 2."""
    sf, floor = safety(model.law.damping), model.law.spring.normal.max()
    found = sums(model, state, pair_masses=False)
    stiff, viscous = found.discs, found.disc_dashpots
    state.mass[:] = _mass(np.maximum(np.maximum(stiff[:, 0], stiff[:, 1]), floor), viscous, sf)
    state.inertia[:] = np.maximum(_inertia(stiff[:, 2], viscous, state.mass, sf), 0.5 * state.mass * state.radius**2)
    if state.clumps is not None:
        body, viscous = state.clumps.motion, found.clump_dashpots
        largest = np.maximum(found.clumps[:, 0], floor)
        body[:, MASS] = _mass(largest, viscous, sf)
        body[:, INERTIA] = _inertia(np.maximum(found.clumps[:, 1], largest * state.clumps.gyration), viscous, body[:, MASS], sf)


def _mass(stiffness, viscous, sf):
    if viscous is None:
        return stiffness / (sf * sf)
    c = viscous[:, 0]
    return (0.5 * (c + np.sqrt(c * c + 4.0 * stiffness / (sf * sf)))) ** 2


def _inertia(stiffness, viscous, mass, sf):
    if viscous is None:
        return stiffness / (sf * sf)
    return stiffness / (sf * sf) + viscous[:, 1] * np.sqrt(mass)


def set_real_masses(model, state):
    """Sets masses and inertia of discs and clumps from their weights."""
    state.mass[:] = state.weight
    state.inertia[:] = 0.5 * state.weight * state.radius**2
    if state.clumps is not None:
        body, clumps = state.clumps.motion, state.clumps
        inside = clumps.body >= 0
        body[:, MASS] = np.bincount(clumps.body[inside], weights=state.weight[inside], minlength=len(body))
        body[:, INERTIA] = body[:, MASS] * clumps.gyration


def stable_step(model, state):
    """min tau of Eq (5) over the free bodies [s]; every body counts with at least one spring."""
    floor, found = model.law.spring.normal.max(), sums(model, state)
    stiff, single = np.maximum(found.discs[:, 0], found.discs[:, 1]), np.arange(model.count) >= model.ring
    if state.clumps is not None:
        single &= state.clumps.body < 0
    parts = [
        (np.maximum(stiff, floor), _column(found.disc_dashpots, 0), state.mass, single),
        (found.discs[:, 2], _column(found.disc_dashpots, 1), state.inertia, single),
    ]
    if state.clumps is not None:
        body, there = state.clumps.motion, np.diff(state.clumps.start) > 0
        parts += [
            (np.maximum(found.clumps[:, 0], floor), _column(found.clump_dashpots, 0), body[:, MASS], there),
            (found.clumps[:, 1], _column(found.clump_dashpots, 1), body[:, INERTIA], there),
        ]
    for _, _, mass, free in parts:
        massless = np.flatnonzero(free & ~(mass > 0.0))
        if len(massless):
            raise ArithmeticError(f"disc or clump {massless[0]} has a mass or inertia of {mass[massless[0]]:g} in real time")
    return float(min(_tau(k, c, m)[free].min(initial=np.inf) for k, c, m, free in parts))


def _column(array, index):
    return 0.0 if array is None else array[:, index]


def _tau(k, c, m):
    """tau of Eq (5) [s], infinite for k = 0; a body without mass is held."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return 2.0 * m / (c + np.sqrt(c * c + 4.0 * k * m))
