"""From static mode to real time and back without a load: nothing jumps, in the grid or in the discs.

A state at rest to an unbalanced ratio r has residual forces of at most r F, F the mean force. Undamped, a chain of n bodies with
contacts of stiffness k moves by some n r F/k about a new rest, with n the number of discs across the window. Velocities per step
that were taken for those per second, other dashpots or a kick of the masses would move it by orders of magnitude more.
"""

from itertools import pairwise

import numpy as np
import pytest

import colluvium

REAL = {"kind": "overload", "time": "real", "damping": {"local": 0.0}, "until": {"steps": 300}}
KN = 5.0e7  # of a disc; a contact of two in series


@pytest.fixture(scope="module")
def run(tmp_path_factory, configs):
    scene = colluvium.Scene.read(configs / "quick_slope.toml", ["discs.radius=0.08", "record.energy=true", "record.every=100000"])
    tables = scene.drawn.model_dump(mode="json", exclude_none=True)
    tables["stage"][2]["until"] = {"ratio": 1e-6, "steps": 20000}
    tables["stage"][3:] = [
        {"name": "stand"} | REAL,
        {"name": "shorter", "step_factor": 0.02} | REAL,
        {"name": "static", "kind": "overload", "until": {"steps": 300}},
        {"name": "again"} | REAL,
    ]
    with colluvium.run(colluvium.Scene(**tables), tmp_path_factory.mktemp("switch") / "run") as found:
        yield found


STAGES = ("couple", "stand", "shorter", "static", "again")


@pytest.fixture(scope="module")
def rest(run):
    """Bound n r F/k of the motion [m], and the sum of the contact forces [N], of the state at rest."""
    couple = next(row for row in run.info["stages"] if row["name"] == "couple")
    ratio = max(couple["ratio_continuum"], *couple["ratio_discrete"])
    assert ratio <= 1e-6
    last = run.last_frame("couple")
    discs, force = run.discs(last), run.contacts(last).normal_force
    across = np.ptp(discs.xy[:, 1]) / (2.0 * discs.radius.mean())
    assert 20 < across < 40
    return across * ratio * force[force > 0.0].mean() / (0.5 * KN), force.sum()


@pytest.mark.long
@pytest.mark.parametrize(("before", "after"), list(pairwise(STAGES)))
def test_nothing_moves_when_the_mode_changes(run, rest, before, after):
    ends = [run.last_frame(name) for name in (before, after)]
    for of in (lambda frame: run.discs(frame).displacement, lambda frame: run.gridpoints(frame).displacement):
        moved = np.hypot(*(of(ends[1]) - of(ends[0])).T)
        assert moved.max() < rest[0]


@pytest.mark.long
def test_energies_do_not_jump(run, rest):
    """Contact forces times their motion bound the change of what is stored; the motion has a small part of that."""
    begin = run.frames[run.last_frame("couple")].step + 1
    steps, kinetic = run.history("energy_kinetic", 1)
    stored = run.history("energy_stored", 1)[1][steps > begin]
    bound = rest[0] * rest[1]
    assert np.ptp(stored) < bound
    assert kinetic[steps > begin].max() < 1e-3 * bound
    assert stored.min() > 1e3 * bound
