"""The list of cracks through the files of a rank: written in rows, read as one, cut where a run was resumed."""

import csv

import numpy as np
import pytest

from colluvium.results import tables
from colluvium.results.rank_parts import RankParts
from colluvium.results.run import open_run
from coupler_protocol.files.recorder import FrameInfo, Recorder


def rows(*steps):
    """Columns of cracks at these steps."""
    count, step = len(steps), np.array(steps)
    return {
        "step": step,
        "time": 0.5 * step,
        "place": np.column_stack((step, -step)),
        "normal": np.tile([0.6, 0.8], (count, 1)),
        "size": np.full(count, 0.2),
        "disc_a": step + 1,
        "disc_b": step + 2,
        "material_a": np.ones(count, np.int32),
        "material_b": np.full(count, 2, np.int32),
        "mode": np.where(step % 2, 3, 2).astype(np.int32),
        "bond": np.zeros(count, np.int32),
    }


def write(path, batches, frames, **about):
    """A file of discs with cracks in batches, and frames at steps."""
    disc = {"points": np.array([[0.0, 0.0]]), "cells": np.zeros((0, 2), int), "cell_fields": {}}
    with Recorder(path, "discrete", attributes=about) as recorder:
        for batch in batches:
            columns = rows(*batch)
            recorder.cracks(columns)
            columns["size"][:] = -1.0  # the caller may use its arrays again
        for step in frames:
            fields = {"id": np.zeros(1, int), "radius": np.ones(1)}
            recorder.frame(FrameInfo(step, 1.0 * step, "go", 1.0), **disc, point_fields=fields)


def test_rows_come_back_as_they_were_written(tmp_path):
    write(tmp_path / "dem.rank1.vtkhdf", [(10, 10, 11), (30,)], (0, 40))
    with open_run(tmp_path) as run:
        found = run.cracks()
        assert found.step.tolist() == [10, 10, 11, 30]
        assert found.time.tolist() == [5.0, 5.0, 5.5, 15.0]
        assert found.in_tension.tolist() == [True, True, False, True]
        assert found.size.tolist() == [0.2] * 4
        np.testing.assert_allclose(found.segments[0], [[10.08, -10.06], [9.92, -9.94]])
        tables.write(run, 0, tmp_path)
    with open(tmp_path / "cracks.rank1.csv", encoding="utf-8") as file:
        read = list(csv.DictReader(file))
    assert [row["step [-]"] for row in read] == ["10", "10", "11", "30"]
    assert read[3]["place_y [m]"] == "-30"


@pytest.mark.parametrize(("about", "kept"), [({"kept_step": 20}, [10, 20]), ({"kept_stages": ["go"]}, [10, 20])])
def test_a_resumed_run_has_each_crack_once(tmp_path, about, kept):
    """The first part was killed after the checkpoint of step 20, from which the second one continued."""
    write(tmp_path / "dem.rank1.vtkhdf", [(10, 20), (30, 40)], (0, 20))
    write(tmp_path / "dem.rank1.part1.vtkhdf", [(30,), (50,)], (60,), **about)
    parts = RankParts([tmp_path / "dem.rank1.vtkhdf", tmp_path / "dem.rank1.part1.vtkhdf"])
    assert parts.cracks().step.tolist() == [*kept, 30, 50]
    parts.close()


def test_a_run_without_breaks_has_an_empty_list(tmp_path):
    write(tmp_path / "dem.rank1.vtkhdf", [], (0,))
    with open_run(tmp_path) as run:
        assert len(run.cracks().step) == 0
        assert run.cracks().segments.shape == (0, 2, 2)


def test_columns_that_do_not_fit_are_refused(tmp_path):
    with Recorder(tmp_path / "dem.rank1.vtkhdf", "discrete") as recorder:
        for wrong in ({"step": np.zeros(1)}, rows(1, 2) | {"size": np.zeros(1)}):
            with pytest.raises(ValueError, match="columns of one length"):
                recorder.cracks(wrong)
