"""Rules between materials, damping and time of a scene; found by the scene reader through `colluvium.rules`."""

from coupler_protocol.scene.changes import in_stage
from coupler_protocol.scene.scene import distribution_of
from coupler_protocol.scene.schedule import acting_boundaries
from coupler_protocol.scene.stage_kinds import of
from fdm_server.effects import added_laws
from fdm_server.effects.softening import curves


def laws_fit_together(scene):
    """In all stages: added laws can be computed, softening has a strength that it changes, dilation never exceeds friction."""
    yield from _laws_fit(scene)
    for s, stage in enumerate(scene.stage):
        names = {table.name: k for k, table in enumerate(stage.material)}
        for (_, i, *rest), why, remedy in _laws_fit(in_stage(scene, s)) if names else ():
            if scene.material[i].name in names:
                yield ("stage", s, "material", names[scene.material[i].name], *rest), why, remedy


def _laws_fit(scene):
    for name, effect in added_laws.declared().items():
        lacks = added_laws.missing(effect)
        for i, m in enumerate(scene.material):
            if lacks and getattr(m, name, None) is not None:
                owner = distribution_of(f"material.{name}")
                why = f"no kernel computes material.{name}: its file, of distribution {owner!r}, has {lacks}"
                yield ("material", i, name), why, "fdm_server/effects/added_laws.py says what a law file holds"
    for i, m in enumerate(scene.material):
        if m.softening is None:
            continue
        at = ("material", i, "softening")
        if m.mohr_coulomb is None:
            yield at, "softening needs Mohr-Coulomb", "add mohr_coulomb = { friction = .., cohesion = .. } or remove the table"
            continue
        if m.softening.tension is not None and m.tension is None:
            yield (*at, "tension"), "a softening tensile strength needs the table tension", "add tension = { strength = .. }"
        values = curves(m.softening, m.mohr_coulomb, m.tension)
        for strain, phi, psi in zip(m.softening.strain, values["friction"][1:], values["dilation"][1:], strict=True):
            if psi > phi:
                why = f"at strain {strain:g} dilation {psi:g} deg exceeds friction {phi:g} deg: such flow creates energy"
                yield (*at, "dilation"), why, "let dilation fall with friction: dilation <= friction at every strain"


def time_fits_the_stages(scene):
    """Seconds and Rayleigh damping belong to real time, kinetic damping to static stages."""
    for i, stage in enumerate(scene.stage):
        at = ("stage", i)
        damping = scene.damping if stage.damping is None else stage.damping
        if not of(stage).computes and (stage.in_real_time or stage.damping is not None):
            yield at, f"a stage of kind {stage.kind} computes no steps", "remove time and damping here"
        if of(stage).computes and stage.in_real_time and damping is not None and damping.kind == "kinetic":
            why = "kinetic damping stops all motion at its peaks, which is none in seconds"
            yield (*at, "damping"), why, "give the stage damping = { local = 0.0 }, or { rayleigh = { .. } }"
        if not of(stage).computes or stage.in_real_time:
            continue
        if damping is not None and damping.kind == "kinetic" and any(moves(b) for b in acting_boundaries(scene, i)):
            why = (
                "kinetic damping needs ground that comes to rest, and a side is driven: its load would scatter by several percent"
            )
            yield (*at, "damping"), why, "give the stage damping = { local = 0.8 }"
        if stage.until is not None and stage.until.time is not None:
            yield (*at, "until", "time"), "a static stage has no seconds", 'use steps or ratio, or time = "real"'
        if stage.step_factor is not None:
            yield (*at, "step_factor"), "the step of a static stage is 1", 'remove the key, or use time = "real"'
        if damping is not None and damping.rayleigh is not None:
            why = "Rayleigh damping needs a frequency, which a static stage does not have"
            yield (*at, "damping"), why, "give the stage damping = { local = 0.8 }"


def moves(boundary):
    """Whether a boundary drives its side in static steps."""
    return boundary.velocity is not None and any((boundary.velocity.x, boundary.velocity.y))
