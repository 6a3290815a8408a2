"""Takeover of zones by a packing: weight and stress of the zones, stiff and rigid or bonded stones, bonds at contacts."""

import logging

from dem_server.insitu import virtual_strain
from dem_server.observe import unbalanced_ratio
from dem_server.step import bonds_made
from dem_server.step.contact_pass import contact_forces
from dem_server.stones import bodies

log = logging.getLogger(__name__)
NOTICED = 0.05  # imbalance of the zones' stress, as a share of the weight, above which a warning is logged


def take_over(model, state, target, gravity, mesostructure=None, body="clump", matching=True, stressed=True, note=None):
    """Prepares a packing, its discs assigned to stones, for coupling; returns the new model and the report.

    target (z, 7): x, y, area, xx, yy, xy, density of the zones; gravity [m/s2]; mesostructure: stones of `body`, or None;
    matching: discs get the weight of the zones; stressed: discs are brought to the zones' stress; note(text, fraction): progress.
    """
    report = {}
    if matching:
        report["density_factor"] = float(virtual_strain.match_weight(model, state, target))
    if stressed:
        aim = virtual_strain.aim_of(model, state, target)
        found = virtual_strain.bring_to_stress(model, state, target, gravity, note)
        aim = virtual_strain.final_aim(aim, found.further_rounds)
        report |= found._asdict() | virtual_strain.against_zones(state, aim)
        if max(abs(found.imbalance_x), abs(found.imbalance_y)) > NOTICED:
            left = 100.0 * found.imbalance_x, 100.0 * found.imbalance_y
            log.warning("the zones' stress does not balance the weight: %+.1f %% of it remains along x, %+.1f %% along y", *left)
    if mesostructure is not None:
        model = bodies.form_stones(model, state, mesostructure.outlines, body)
        if stressed:
            virtual_strain.come_to_rest(model, state, gravity, note)
            report["ratio"] = unbalanced_ratio.unbalanced_ratio(model, state, gravity)
            errors = virtual_strain.stress_error(state, aim, mesostructure.outlines).tolist()
            report |= dict(zip(("error_xx", "error_yy", "error_xy"), errors, strict=True))
            report |= virtual_strain.against_zones(state, aim, mesostructure.outlines)
        virtual_strain.reset_broken_bonds(state)
    bond(model, state)
    return model, report


def bond(model, state):
    """Bonds all closed contacts whose materials have contact bonds or parallel bonds."""
    if model.law.bond is not None:
        bonds_made.add_bonds(model, state)
    if model.law.parallel_bond is not None:
        bonds_made.add_parallel_bonds(model, state)
    contact_forces(model, state)
