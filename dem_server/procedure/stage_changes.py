"""Changes of the discs' law at the start of a stage: parameters, histories of contacts, new bonds, and what they do to energy."""

from coupler_protocol.problems import unfit
from coupler_protocol.scene.changes import changes_anything, changes_discs, in_stage
from coupler_protocol.scene.used_materials import discs_used
from dem_server.effects import histories, law_from
from dem_server.observe import energy
from dem_server.step import bonds_made, changed_law
from dem_server.step.neighbours import skin


class StageChange:
    """The change of one stage: made before the clock of the stage begins, completed after it has made a new list of pairs."""

    def __init__(self, scene, index, model, state):
        self.name, table = scene.stage[index].name, scene.stage[index].discs
        self.gap = table.bond_gap if table is not None else None
        self.before, self.stored = model.law, energy.stored(model, state)
        now = in_stage(scene, index)
        self.model = changed_law.with_law(model, state, law_from(discs_used(now), now.ring))

    def complete(self, model, state):
        """Makes bonds and computes contact forces; returns a row of `changes` in run.json."""
        if self.gap is not None and self.gap > skin(model):
            why = f"a gap of {self.gap:g} m is more than 0.3 of the smallest radius"
            raise unfit("stage.discs.bond_gap", why, f"at most {skin(model):.2g} m")
        made = bonds_made.bond_from_now_on(model, state, self.before, self.gap)
        changed_law.forces_at_rest(model, state)
        return {"stage": self.name, "bonds_made": made, "stored_energy": [self.stored, energy.stored(model, state)]}


def begin(scene, index, model, state):
    """The StageChange of the stage with this number, or None if it changes nothing of the discs."""
    return StageChange(scene, index, model, state) if changes_discs(scene.stage[index]) else None


def recorded_fields(scene):
    """Fields of contacts {name: type} that the law of any stage records, {} if no stage changes it: all frames have the same."""
    found = {}
    for index in range(len(scene.stage)) if changes_anything(scene) and scene.discs is not None else ():
        now = in_stage(scene, index)
        found |= histories.fields_recorded(law_from(discs_used(now), now.ring))
    return found
