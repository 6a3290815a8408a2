"""No cohesion, no tensile strength, phi = 55 degrees, nu = 0.4995.

`tests/hard/weak_ground.toml`: a face of 45 degrees with a window of discs without bonds behind its toe, in static mode. Both
codes must come to rest, the base must carry the weight, and the mean stress of every zone must be admissible,

    (s1 - s3) + (s1 + s3) sin(phi) <= 0,    s1 <= 0

(s1 >= s3, tension positive; means of admissible stresses are admissible), over the vertical stress at the base. The same ground
with psi = 60 degrees > phi must be refused by name."""

import tempfile

import numpy as np

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from fdm_server.observe import fields
from verification.hard.runs import ended
from verification.hard.watched import scene_of
from verification.verdict_rows import row

NAME = "weak ground"
FRICTION, DENSITY, GRAVITY = np.radians(55.0), 2000.0, 9.81
AREA, HEIGHT = 9.0 * 3.0 + 3.0 * 3.0 + 0.5 * 3.0 * 3.0, 6.0  # of the ground [m2], [m]


def refusal():
    """What a scene with psi > phi is refused with, "" if it is not."""
    tables = scene_of("weak_ground")
    tables["material"][0]["mohr_coulomb"]["dilation"] = 60.0
    try:
        build_scene(tables)
    except SceneError as error:
        return str(error)
    return ""


def rows(fast):
    """Seconds; the fast form is the same."""
    seen, yielded = {}, {}

    def note(moment):
        if moment.rank == 0:
            seen[moment.stage] = fields.stress(moment.model, moment.state)
            yielded[moment.stage] = int(np.count_nonzero(fields.plastic_state(moment.model, moment.state)))

    with tempfile.TemporaryDirectory() as folder:
        found = ended(scene_of("weak_ground"), folder, on_stage=note)
    yield row("exit code", found.code, 0.0, 0.0, "as asked for")
    about = found.row("couple")
    ratio = max(about["ratio_continuum"], *about["ratio_discrete"])
    yield row(f"unbalanced ratio of both codes after {about['steps']} coupled steps", ratio, 0.0, 1e-4, "as asked for")
    base, weight = about["reactions"]["bottom"]["y"], DENSITY * GRAVITY * AREA
    yield row("reaction of the base over the weight", base / weight, 1.0, 1e-4, "equilibrium")
    scale = DENSITY * GRAVITY * HEIGHT
    for stage, stress in seen.items():
        if stage == "fill":
            continue
        xx, yy, xy = stress[:, 0], stress[:, 1], stress[:, -1]
        mean, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
        beyond = (2.0 * (radius + mean * np.sin(FRICTION))).max() / scale
        yield row(f"{stage}: zones that have yielded, at least", yielded[stage], 1.0, [0.0, 1e3], "as asked for")
        yield row(f"{stage}: largest stress beyond the friction", max(beyond, 0.0), 0.0, 1e-9, "Mohr-Coulomb")
        yield row(f"{stage}: largest tension", max((mean + radius).max() / scale, 0.0), 0.0, 1e-9, "tension cut-off")
    yield row("psi > phi is refused by name", "dilation 60 deg exceeds friction 55 deg" in refusal(), 1.0, 0.0, "as asked for")
