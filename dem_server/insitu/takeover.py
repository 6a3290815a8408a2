"""A packing takes the place of zones: their weight, their stress, stones stiff and whole, bonds where discs touch."""

import logging

from dem_server.insitu import virtual_strain as insitu
from dem_server.observe import unbalanced_ratio as balance
from dem_server.step import bonds_made as bonding
from dem_server.step.contact_pass import contact_forces
from dem_server.stones import bodies as stones

log = logging.getLogger(__name__)
NOTICED = 0.05  # share of the weight that the zones' stress may miss without a word


def take_over(model, state, target, gravity, mesostructure=None, body="clump", matching=True, stressed=True, note=None):
    """Everything between a marked packing and discs that can be coupled. Returns the new model and what to report.

    target (z, 7): x, y, area, xx, yy, xy, density of the zones; gravity [m/s2]; mesostructure: stones of `body`, or None;
    matching: discs weigh what the zones did; stressed: they are brought to the zones' stress; note(text, fraction): progress.
    """
    report = {}
    if matching:
        report["density_factor"] = float(insitu.match_weight(model, state, target))
    if stressed:
        aim = insitu.aim_of(model, state, target)
        found = insitu.bring_to_stress(model, state, target, gravity, note)
        report |= found._asdict()
        if max(abs(found.imbalance_x), abs(found.imbalance_y)) > NOTICED:
            left = 100.0 * found.imbalance_x, 100.0 * found.imbalance_y
            log.warning("the zones' stress does not bear the weight: %+.1f %% left over along x, %+.1f %% along y", *left)
    if mesostructure is not None:
        model = stones.make(model, state, mesostructure.outlines, body)
        if stressed:
            insitu.come_to_rest(model, state, gravity)
            report["ratio"] = balance.unbalanced_ratio(model, state, gravity)
            errors = insitu.stress_error(state, aim, mesostructure.outlines).tolist()
            report |= dict(zip(("error_xx", "error_yy", "error_xy"), errors, strict=True))
        insitu.forget_breakage(state)
    bond(model, state)
    return model, report


def bond(model, state):
    """Bond all closed contacts whose materials have contact bonds or parallel bonds."""
    if model.law.bond is not None:
        insitu.add_bonds(model, state)
    if model.law.parallel_bond is not None:
        bonding.add_parallel_bonds(model, state)
    contact_forces(model, state)
