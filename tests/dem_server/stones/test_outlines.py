"""Outlines of stones from GeoJSON and CSV: where they come to lie, and what is said about files that cannot be used."""

import json

import numpy as np
import pytest

from coupler_protocol.geometry import polygon_area
from dem_server.stones.outlines import OutlineError, overlapping, read_outlines

TRIANGLE = [[0.0, 0.0], [4.0, 1.0], [1.0, 3.0]]
BOWTIE = [[0, 0], [2, 2], [2, 0], [0, 2], [0, 0]]


def geojson(tmp_path, *geometries, names=()):
    """A FeatureCollection of (type, coordinates)."""
    features = [{"type": "Feature", "properties": None, "geometry": {"type": t, "coordinates": c}} for t, c in geometries]
    for feature, name in zip(features, names, strict=False):
        feature["properties"] = {"name": name}
    path = tmp_path / "stones.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}), encoding="utf-8")
    return path


def closed(ring):
    return [*ring, ring[0]]


def square(x, y, side=1.0):
    return closed([[x, y], [x + side, y], [x + side, y + side], [x, y + side]])


def test_polygons_and_parts_of_multipolygons(tmp_path):
    hole = square(0.2, 0.2, 0.1)
    path = geojson(tmp_path, ("Polygon", [square(0, 0), hole]), ("MultiPolygon", [[square(2, 0)], [square(4, 0)]]), names=["A"])
    found = read_outlines(path)
    assert [o.name for o in found] == ["feature 1 (A)", "feature 2, part 1", "feature 2, part 2"]
    assert [polygon_area(o.corners) for o in found] == [1.0, 1.0, 1.0]  # holes are stone
    assert [o.corners.shape for o in found] == [(4, 2)] * 3


@pytest.mark.parametrize("turned", [False, True])
def test_units_origin_and_image_coordinates(tmp_path, turned):
    """Eq (1), and counter-clockwise whichever way round the file goes."""
    ring = TRIANGLE[::-1] if turned else TRIANGLE
    (plain,) = read_outlines(geojson(tmp_path, ("Polygon", [closed(ring)])), 0.5, (10.0, 20.0))
    (image,) = read_outlines(geojson(tmp_path, ("Polygon", [closed(ring)])), 0.5, (10.0, 20.0), flip_y=True)
    assert polygon_area(plain.corners) == polygon_area(image.corners) == 0.25 * 5.5
    assert {tuple(p) for p in plain.corners.tolist()} == {(10.0, 20.0), (12.0, 20.5), (10.5, 21.5)}
    assert {tuple(p) for p in image.corners.tolist()} == {(10.0, 20.0), (12.0, 19.5), (10.5, 18.5)}


def test_a_table_holds_corners_in_order(tmp_path):
    path = tmp_path / "stones.csv"
    rows = [f"{name},{x},{y}" for name, dx in (("b7", 0.0), ("b8", 9.0)) for x, y in np.add(TRIANGLE, [dx, 0.0]).tolist()]
    path.write_text("\n".join(["stone,x,y", *rows]), encoding="utf-8")
    found = read_outlines(path)
    assert [o.name for o in found] == ["stone b7", "stone b8"]
    np.testing.assert_array_equal(found[1].corners, np.add(TRIANGLE, [9.0, 0.0]))


def test_every_problem_is_told_at_once(tmp_path):
    path = geojson(
        tmp_path,
        ("Polygon", [square(0, 0)]),
        ("Polygon", [BOWTIE]),
        ("LineString", TRIANGLE),
        ("Polygon", [[[0, 0], [1, 1], [0, 0]]]),
        ("Polygon", [[[0, 0], ["x", 1], [1, 0]]]),
        ("Polygon", [[[0, 0], [float("nan"), 1], [1, 0]]]),
        names=["good", "crossed"],
    )
    with pytest.raises(OutlineError) as error:
        read_outlines(path)
    told = [why for why, _ in error.value.problems]
    assert len(told) == 5
    for words in (
        "2 (crossed) crosses",
        "3 is a LineString",
        "4 has 2 corners",
        "coordinates of feature 5",
        "a corner of feature 6",
    ):
        assert any(words in why for why in told), (words, told)
    assert not any("good" in why for why in told)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.geojson", "{", "not valid JSON"),
        ("a.geojson", '{"type": "FeatureCollection", "features": []}', "no stone"),
        ("a.json", '{"type": "FeatureCollection", "features": 3}', "no stone"),
        ("a.json", "[1, 2]", "not a geometry"),
        ("a.csv", "stone,x\n1,2\n", "column 'y' is missing"),
        ("a.csv", "stone,x,y\n1,0,0\n1,one,0\n1,1,1\n1,0,1", "line 3 holds no corner"),
        ("a.csv", "stone,x,y\n1,0,0\n1,1,0\n", "stone 1 has 2 corners"),
        ("a.csv", "stone,x,y\n1,0,5,0,5\n", "line 2 has more columns than the head line"),
        ("a.csv", "stone,x,y\n,0,0\n", "line 2 has no stone"),
        ("a.csv", "stone,x,y\n1,,0\n", "line 2 holds no corner"),
        ("a.json", '{"type": "Polygon", "coordinates": [[["0", "0"], ["1", "0"], ["1", "1"]]]}', "not those of a Polygon"),
        ("a.json", '{"type": "Polygon", "coordinates": [[[0, 0], [true, 0], [1, 1]]]}', "not those of a Polygon"),
        ("a.json", '{"type": "Polygon", "coordinates": [["00", "10", "11"]]}', "not those of a Polygon"),
        ("a.json", '{"type": "Polygon", "coordinates": [[[0, 0], [null, 0], [1, 1]]]}', "not those of a Polygon"),
        ("a.csv", "stone,x,y\n1,0,0\n1,1,1\n1,2,2\n", "stone 1"),
    ],
)
def test_files_that_cannot_be_used(tmp_path, name, text, words):
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(OutlineError, match=words):
        read_outlines(tmp_path / name)


def test_a_missing_file(tmp_path):
    with pytest.raises(OutlineError, match="there is no such file"):
        read_outlines(tmp_path / "none.geojson")


def test_overlaps_name_both_and_shared_edges_are_none(tmp_path):
    path = geojson(tmp_path, ("Polygon", [square(0, 0)]), ("Polygon", [square(1, 0)]), ("Polygon", [square(1.5, 0.5)]))
    assert list(overlapping(read_outlines(path))) == [("feature 2", "feature 3", 0.25)]
