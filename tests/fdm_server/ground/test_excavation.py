"""Which zones an excavation takes, and which it may not."""

from types import SimpleNamespace

import numpy as np
import pytest
from grid_cases import slope, window

from fdm_server.ground.excavation import excavations
from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.grid_sides import fixed_components, surface_edges
from fdm_server.mesh.window_zones import rim_of, window_zones
from fdm_server.mesh.zone_sides import pieces


def dug(*tables, rims=()):
    """Masks of excavations of a scene, one stage for each table."""
    stages = [
        SimpleNamespace(kind="excavate", name=f"dig {n}", excavate=SimpleNamespace(**({"polygon": None} | table)))
        for n, table in enumerate(tables)
    ]
    held = fixed_components(grid(), slope().boundary)
    return excavations(SimpleNamespace(stage=stages), grid(), lambda _: held, rims)


def grid():
    return build_grid(slope())


def a_rim():
    mask = window_zones(grid(), window())
    return SimpleNamespace(mask=mask, nodes=rim_of(grid(), mask))


def test_by_columns_and_rows_or_by_a_polygon():
    by_number = dug({"columns": (2, 5), "rows": (9, 11)})[0]
    by_outline = dug({"polygon": [(0.7, 3.0), (2.0, 3.0), (2.0, 4.1), (0.7, 4.1)]})[0]
    assert by_number.sum() == 12
    assert np.array_equal(by_number, by_outline)


def test_zones_are_dug_once():
    first, second = dug({"columns": (2, 5), "rows": (10, 11)}, {"columns": (2, 5), "rows": (9, 11)}).values()
    assert (first.sum(), second.sum()) == (8, 4)
    assert not np.any(first & second)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"columns": (2, 5), "rows": (20, 25)}, "contains no zones"),
        ({"columns": (39, 40), "rows": (20, 35)}, "touches a window"),
        ({"columns": (32, 45), "rows": (32, 35)}, "touches a window"),
        ({"polygon": [(10.0, 11.3), (20.0, 11.3), (20.0, 11.7), (10.0, 11.7)]}, "leaves unsupported zones"),
        ({"columns": (0, 900), "rows": (0, 900)}, "touches a window"),
    ],
)
def test_what_cannot_be_meant_is_refused(table, words):
    with pytest.raises(ValueError, match=words):
        dug(table, rims=[a_rim()])


def test_pieces_are_joined_by_sides():
    squares = np.array([[0, 1, 4, 3], [4, 5, 8, 7]])  # two of four cells, diagonally
    assert len(set(pieces(squares))) == 2
    assert len(set(pieces(np.vstack([squares, [[1, 2, 5, 4]]])))) == 1
    assert len(set(pieces(np.array([[0, 1, 2, 2], [1, 3, 2, 2]])))) == 1


def test_a_trench_may_part_the_ground_as_long_as_both_sides_stand():
    assert dug({"columns": (50, 52), "rows": (0, 35)})[0].sum() == 3 * 36


def test_the_ground_surface_follows_what_was_dug_and_leaves_windows_out():
    mesh, rim = grid(), a_rim()
    left = ~rim.mask & ~dug({"columns": (2, 5), "rows": (9, 11)})[0]
    surface = surface_edges(mesh, mesh.zones[left], [rim.nodes])
    length = np.hypot(*(mesh.xy[surface[:, 1]] - mesh.xy[surface[:, 0]]).T).sum()
    assert length == pytest.approx(11 / 3 + 8 * 2**0.5 + 25 / 3 + 2.0)  # the pit is a metre deep: two walls more


def test_an_excavation_of_everything_is_refused_in_words():
    with pytest.raises(ValueError, match="removes all the ground that is left: leave some of it"):
        dug({"columns": (0, 900), "rows": (0, 900)})
