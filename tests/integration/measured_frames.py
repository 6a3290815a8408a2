"""Histories of regions against the means of frames: the same regions, measured twice."""

import numpy as np


def assert_histories_are_those_of_frames(run, regions, rank=1):
    """Stress and porosity of each region {name: region}, at every frame after the first one of a rank; returns how many."""
    frames = [i for i in range(len(run.frames)) if run.has(i, rank)][1:]
    at = {name: run.history(name, rank) for name in run.histories(rank) if name.partition(":")[2] in regions}
    seen = 0
    for i in frames:
        for name, region in regions.items():
            row = at[f"porosity:{name}"][0].tolist().index(run.frames[i].step)
            values = {key.partition(":")[0]: column[1][row] for key, column in at.items() if key.endswith(f":{name}")}
            stress = [values[f"stress_{part}"] for part in ("xx", "yy", "xy")]
            expected = run.average_stress(i, region, rank)
            np.testing.assert_allclose(stress, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
            np.testing.assert_allclose(values["porosity"], run.porosity(i, region, rank), rtol=1e-9)
            assert all(np.isfinite(value) for value in values.values()), values
            assert values["stress_yy_error"] > 0.0
            assert 0.0 < values["porosity_error"] < 0.1
            assert 0.0 < values["coordination"] < 6.0
            seen += 1
    return seen
