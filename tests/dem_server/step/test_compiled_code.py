"""What the compiler made of the discs' kernels: no reference counts in loops, vector instructions in the contact law.

Where either is lost a step takes two to four times as long, and nothing else shows it.
"""

import json
import os
import platform

import numba
import numpy as np
import pytest

from tests.commands import ROOT, command, finished
from tests.dem_server.step.reference_counts import counts_in_loops

pytestmark = pytest.mark.long


@numba.njit
def keeps(arrays, n):
    kept = arrays[0]
    for i in range(n):
        kept = arrays[i % 2]
        kept[0] += 1.0
    return kept


@numba.njit
def clean(a):
    for i in range(len(a)):
        a[i] += 1.0
    return a


def test_the_count_sees_what_it_looks_for():
    keeps((np.zeros(3), np.zeros(3)), 4)
    clean(np.zeros(3))
    assert counts_in_loops(keeps) > 0
    assert counts_in_loops(clean) == 0


@pytest.fixture(scope="module")
def inspected():
    environment = os.environ | {"PYTHONPATH": os.pathsep.join((str(ROOT), str(ROOT / "scripts")))}
    done = finished(command("tests.dem_server.step.inspected_kernels"), env=environment)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_no_loop_of_any_kernel_counts_references(inspected):
    assert {name: count for name, count in inspected["counts"].items() if count} == {}


def test_the_kernels_were_seen(inspected):
    names = {name.rpartition(".")[2] for name in inspected["counts"]}
    others = {"near_pairs", "sorted_pairs", "places", "quickest_kernel"}
    assert others | {"force_pass", "move", "cycle", "add_up", "ratio", "wall_pass", "move_walls"} <= names


@pytest.mark.skipif(platform.machine() != "x86_64", reason="looks for instructions of x86-64")
def test_roots_and_divisions_are_taken_of_many_contacts_at_once(inspected):
    assert inspected["vector"] == [[True, True]] * 4
