"""Force chains of arrangements whose chains are known."""

import numpy as np
import pytest

from colluvium.results.force_chains import force_chains


class Rows(dict):
    """Arrays by name, as of a frame."""

    __getattr__ = dict.__getitem__


R = 0.1


def columns(force, turned=0.0, rows=6):
    """A square lattice of touching discs; its columns carry `force` (columns,) along the first axis, turned by an angle [rad]."""
    count = len(force)
    at = np.stack(np.meshgrid(np.arange(rows), np.arange(count), indexing="ij"), axis=-1).reshape(-1, 2) * 2.0 * R
    number = np.arange(rows * count).reshape(rows, count)
    up = np.column_stack([number[:-1].ravel(), number[1:].ravel()])
    across = np.column_stack([number[:, :-1].ravel(), number[:, 1:].ravel()])
    c, s = np.cos(turned), np.sin(turned)
    ends = np.concatenate([up, across])
    normal = np.concatenate([np.tile(force, rows - 1), np.ones(len(across))])
    discs = Rows(xy=at @ np.array([[c, s], [-s, c]]), radius=np.full(len(at), R))
    return discs, Rows(ends=ends, normal_force=normal)


@pytest.mark.parametrize("degrees", [0.0, 35.0, 120.0])
def test_columns_under_more_than_the_mean_are_chains_along_their_force(degrees):
    found = force_chains(*columns(np.array([10.0, 100.0, 10.0, 100.0, 10.0]), np.radians(degrees)))
    assert (found.chains, found.bodies, found.longest) == (2, 12, 6)
    assert found.share == pytest.approx(12 / 30)
    assert found.direction == pytest.approx(degrees, abs=1e-9)
    assert found.agreement == pytest.approx(1.0)
    assert sorted(np.bincount(found.chain)) == [5, 5]
    assert set((found.links % 5).ravel().tolist()) == {1, 3}


def test_two_strong_neighbours_are_no_chain():
    discs, contacts = columns(np.array([10.0, 10.0]))
    contacts["normal_force"][0] = 500.0
    found = force_chains(discs, contacts)
    assert (found.chains, found.bodies, found.share, len(found.links)) == (0, 0, 0.0, 0)
    assert np.isnan(found.direction)


def test_control_discs_and_bodies_beside_the_direction_are_left_out():
    discs, contacts = columns(np.array([100.0, 100.0, 1.0, 1.0]))
    found = force_chains(discs, contacts)
    assert (found.chains, found.longest) == (2, 6)  # the contacts across, between both strong columns, are no links
    discs["control"] = (np.arange(24) % 4 == 0).astype(int)
    assert force_chains(discs, contacts).chains == 1


def test_a_stone_is_one_body():
    """A chain of six discs of which the middle two are one stone has five bodies; a stone of all six is in no chain."""
    discs, contacts = columns(np.array([1.0, 100.0, 1.0]))
    discs["stone"] = np.full(18, -1)
    discs["stone"][[7, 10]] = 0
    found = force_chains(discs, contacts)
    assert (found.chains, found.bodies, len(found.links)) == (1, 5, 4)
    discs["stone"][np.arange(18) % 3 == 1] = 0
    assert not (force_chains(discs, contacts).links % 3 == 1).any()
