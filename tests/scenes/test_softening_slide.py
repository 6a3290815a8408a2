"""The slide in softening soil: it fails because it softens, moves no faster than it can fall, and its energies add up."""

import numpy as np
import pytest

from colluvium import open_run
from tests.commands import run_colluvium

pytestmark = pytest.mark.long

KEPT = ("--set", "material.0.softening.cohesion=[12e3, 12e3]", "--set", "material.0.softening.tension=[5e3, 5e3]")


def computed(configs, out, *words):
    scene = configs / "softening_slide.toml"
    done = run_colluvium("run", scene, "--out", out, "--in-process", "--quiet", *words)
    assert done.returncode == 0, done.stderr
    return open_run(out)


def test_it_slides_because_it_softens(configs, tmp_path):
    with computed(configs, tmp_path / "brittle") as brittle, computed(configs, tmp_path / "kept", *KEPT) as kept:
        moved, stayed = (run.history("max_displacement")[1] for run in (brittle, kept))
        assert moved[-1] > 1.0
        assert stayed[-1] < 0.02
        assert kept.history("energy_kinetic")[1][-1] < 1e-3 * brittle.history("energy_kinetic")[1][-1]
        seconds = brittle.history("time")[1]
        assert seconds[-1] - seconds[0] == pytest.approx(1.0, abs=0.01)
        assert moved[-1] < 0.5 * 1.5 * 9.81 * 1.0**2
        for run in (brittle, kept):
            work = run.history("energy_gravity")[1]
            assert np.abs(run.history("energy_error")[1]).max() < 1e-9 * np.abs(work).max()
        assert brittle.zones(-1).plastic_shear_strain.max() > 0.1
