"""Boxes of zones under any set of laws: what a law allocates, and a step to time.

box = Box(40, 40, ("elastic", "mohr_coulomb", "softening"), flowing=True)
box.step()                      one step of gridpoints and zones
box.bytes()                     {"state.plastic_shear": 8.0, ...} a zone
"""

from dataclasses import fields

import numpy as np

from bench.timing_rows import row, seconds_of_step
from coupler_protocol.compiled import threads as team
from coupler_protocol.scene.reader import build_scene
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.observe.energy_ledger import Ledger
from fdm_server.step import clock
from fdm_server.step.blocks import from_blocks
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.present_shape import begin_large_strain
from fdm_server.step.zone_pass import advance

TABLES = {
    "elastic": {"bulk": 5e8, "shear": 1.5e8},
    "mohr_coulomb": {"friction": 30.0, "cohesion": 5e4},
    "tension": {"strength": 1e2},
    "softening": {"strain": [0.01, 0.05], "cohesion": [2e4, 1e4], "friction": [28.0, 25.0]},
}
DAMPING = {
    "local": {"local": 0.8},
    "combined": {"combined": 0.8},
    "rayleigh": {"rayleigh": {"fraction": 0.05, "frequency": 5.0}},
}
OTHERS = ("large_strain", "real_time", "energy", "nodal")
LAWS = (*TABLES, *DAMPING, *OTHERS)
PLASTIC = ("elastic", "mohr_coulomb", "tension")
FULL = (*PLASTIC, "local")  # Mohr-Coulomb, tension cut-off, flags, local damping
SETS = (  # what is timed, and whether it flows
    (("elastic", "local"), False),
    (("elastic", "mohr_coulomb", "local"), False),
    (("elastic", "mohr_coulomb", "local"), True),
    (FULL, False),
    (FULL, True),
    ((*FULL, "softening"), False),
    ((*FULL, "softening"), True),
    (("elastic", "local", "large_strain"), False),
    ((*FULL, "large_strain"), False),
    (("elastic", "combined"), False),
    (("elastic", "real_time"), False),
    (("elastic", "rayleigh"), False),
    ((*FULL, "energy"), False),
    ((*FULL, "nodal"), False),
    ((*FULL, "nodal"), True),
)
PRESSURE = -1e6  # [Pa], so that nothing yields at rest
SHEAR = {False: 1e-15, True: 1e-3}  # shear strain a step; flowing: all triangles yield after a few


class Box:
    """width x height zones of 1 m. Gridpoints are so heavy that their velocities stay: every step is the same work."""

    def __init__(self, width, height, laws=("elastic",), flowing=False, threads=1):
        unknown = set(laws) - set(LAWS)
        if unknown:
            raise ValueError(f"no laws of this project: {', '.join(sorted(unknown))}; there are {', '.join(LAWS)}")
        self.zones, self.flowing = width * height, flowing
        soil = {"name": "soil", "density": 2000.0} | {name: TABLES[name] for name in TABLES if name in laws or name == "elastic"}
        mixed = "nodal" if "nodal" in laws else "zone"
        scene = build_scene(
            {
                "format": 1, "seed": 1, "material": [soil],
                "grid": {"kind": "box", "length": float(width), "height": float(height), "zone_size": 1.0, "mixed": mixed},
                "stage": [{"name": "overload", "until": {"steps": 1}}],
            }
        )  # fmt: skip
        damping = next((DAMPING[name] for name in DAMPING if name in laws), {"local": 0.0})
        before = team.size()
        team.set_size(threads)
        self.model = build_model(scene, build_grid(scene))
        team.set_size(before)
        self.state = new_state(self.model)
        table = type(scene).model_fields["damping"].annotation.__args__[0](**damping)
        real = "real_time" in laws or "rayleigh" in laws
        self.model = clock.begin(self.model, self.state, table, clock.STEP_FACTOR if real else None)
        if "large_strain" in laws:
            begin_large_strain(self.model, self.state)
        self.state.stress[:, :32] = PRESSURE  # sm and zz
        self.state.added_mass[:] = 1e60
        x, y = self.model.grid.xy.T
        speed = SHEAR[flowing] / clock.seconds(self.state)
        self.state.velocity[:] = speed * np.column_stack([y + 0.5 * np.sin(y), 0.3 * (x + 0.5 * np.sin(2.0 * x))])
        self.ledger = Ledger(self.model, self.state) if "energy" in laws else None

    def step(self):
        """One step of gridpoints and zones, with its bookings where the ledger is kept."""
        if self.ledger:
            self.ledger.copy_before_step(self.state)
        update_velocities(self.model, self.state, 0.0)
        if self.ledger:
            self.ledger.book_motion(self.model, self.state, 0.0)
        advance(self.model, self.state)
        if self.ledger:
            self.ledger.book_strain(self.model, self.state)

    def settle(self):
        """Steps until every triangle yields (flowing), and as a warm-up. Raises ArithmeticError where zones do otherwise."""
        for _ in range(60 if self.flowing else 3):
            self.step()
        if self.state.plastic is not None:
            yields = from_blocks(self.state.plastic, self.zones) & 3 > 0
            if bool(yields.all()) != self.flowing or bool(yields.any()) != self.flowing:
                raise ArithmeticError(f"{yields.mean():.1%} of the zones yield, flowing={self.flowing}")

    def take(self, steps):
        """Takes steps."""
        for _ in range(steps):
            self.step()

    def seconds(self, steps):
        """Seconds of one step, from `steps` of them."""
        self.step()
        return seconds_of_step(self.take, steps)

    def bytes(self):
        """Bytes a zone of every array of State, of the law's parameters and of the ledger."""
        found = {f"state.{f.name}": getattr(self.state, f.name) for f in fields(self.state)}
        found |= {f"law.{name}": value for name, value in self.model.law._asdict().items()}
        found |= {f"ledger.{name}": value for name, value in self.ledger.book._asdict().items()} if self.ledger else {}
        return {name: value.nbytes / self.zones for name, value in found.items() if isinstance(value, np.ndarray)}


def rows(width, height, work, repeats, companion, say):
    """Cost of a zone-step under the sets of laws above, and what their arrays take."""
    for laws, flowing in SETS:
        name = "laws: " + ", ".join(laws).replace("_", " ") + (", flowing" if flowing else "")
        say(f"preparing {width * height:,} zones, {name}")
        box = Box(width, height, laws, flowing)
        box.settle()
        nanoseconds = [1e9 * box.seconds(max(3, work // box.zones)) / box.zones for _ in range(repeats)]
        note = f"{sum(box.bytes().values()):.0f} B/zone of state, parameters and ledger"
        yield row(name, box.zones, nanoseconds, "ns/zone-step", companion, note)
