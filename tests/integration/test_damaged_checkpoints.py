"""A checkpoint that is not what was written, or that no step can be taken with, is refused by its name before it is used."""

import io
import shutil

import h5py
import numpy as np
import pytest

import colluvium
from coupler_protocol import exits
from coupler_protocol.files import checkpoint, restart, saved_moments, seal
from coupler_protocol.files.restart import Origin
from tests.commands import run_colluvium

GRID = {
    "grid": {"kind": "box", "length": 2.0, "height": 2.0, "zone_size": 0.5},
    "material": [
        {
            "name": "m",
            "density": 2000.0,
            "elastic": {"bulk": 5e7, "shear": 2e7},
            "mohr_coulomb": {"cohesion": 1e4, "friction": 30.0, "dilation": 0.0},
        }
    ],
    "boundary": [{"on": "bottom", "fix": "xy"}, {"on": "left", "fix": "x"}, {"on": "right", "fix": "x"}],
    "damping": {"local": 0.8},
    "stage": [
        {"name": "rest", "kind": "equilibrium", "gravity": 9.81, "until": {"steps": 60}},
        {"name": "more", "kind": "load", "until": {"steps": 40}},
        {"name": "load", "kind": "load", "until": {"steps": 40}},
    ],
}
SOIL = {"density": 2000.0, "spring": {"normal": 5e7, "shear": 2e7}, "bond": {"tension": 1e4, "shear": 1e4}}
DISCS = {
    "discs": {
        "radius": 0.1,
        "soil": SOIL | {"friction": {"coefficient": 0.5}},
        "stone": SOIL,
        "wall": [{"name": "floor", "ends": [[-1.0, -0.1], [3.0, -0.1]]}],
    },
    "stage": [
        {"name": "fill"},
        {"name": "rest", "kind": "discs", "gravity": 9.81, "until": {"steps": 60}},
        {"name": "more", "kind": "discs", "until": {"steps": 40}},
    ],
}
ROWS = "x,y,radius,material,stone\n" + "".join(f"{0.199 * k},0,0.1,{'stone,0' if k > 5 else 'soil,-1'}\n" for k in range(8))
SIDES = {"grid": ("fdm.rank0", "more"), "discs": ("dem.rank1", "rest")}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """{side: (scene, folder)} of two short runs without their last stage."""
    found = {}
    for side, (name, stage) in SIDES.items():
        folder = tmp_path_factory.mktemp(side)
        tables = GRID if side == "grid" else DISCS
        if side == "discs":
            (folder / "row.csv").write_text(ROWS, encoding="utf-8")
            tables = tables | {"discs": tables["discs"] | {"file": str(folder / "row.csv")}}
        scene = colluvium.Scene(format=1, seed=1, record={"every": 20}, **tables)
        colluvium.run(scene, folder / "run").close()
        (folder / "run" / f"{name}.{scene.stage[-1].name}.h5").unlink()
        assert saved_moments.common_in_folder(scene, folder / "run")[0] == Origin(folder / "run", stage).path(name)
        found[side] = scene, folder / "run"
    return found


@pytest.fixture(params=list(SIDES))
def side(request, runs, tmp_path):
    """Scene, origin, process and path of a checkpoint in a copy of a run."""
    scene, folder = runs[request.param]
    name, stage = SIDES[request.param]
    shutil.copytree(folder, tmp_path / "run")
    origin = Origin(tmp_path / "run", stage)
    return scene, origin, name, origin.path(name)


def refused(side, words):
    """The refusal of a checkpoint, which names the file and says these words."""
    scene, origin, name, path = side
    with pytest.raises(exits.EnvironmentFailed, match=words) as error:
        restart.load(scene, origin, name)
    assert str(path) in str(error.value)
    return str(error.value)


def test_a_flipped_bit_anywhere_is_found(side):
    path = side[-1]
    whole = path.read_bytes()
    places = np.random.default_rng(13).integers(0, 8 * len(whole), 200).tolist()
    for place in [*range(0, 8 * seal.ROOM, 97), *places]:
        damaged = bytearray(whole)
        damaged[place // 8] ^= 1 << place % 8
        path.write_bytes(damaged)
        refused(side, "is damaged: ")
    path.write_bytes(whole)
    restart.load(*side[:-1])


def test_the_command_refuses_it_with_code_4_and_offers_the_state_before_it(side):
    scene, origin, _name, path = side
    whole = bytearray(path.read_bytes())
    whole[len(whole) // 2] ^= 16
    path.write_bytes(whole)
    done = run_colluvium("resume", origin.folder, "--quiet")
    earlier = scene.stage[restart.index_of(scene, origin) - 1].name
    assert done.returncode == 4, done.stderr
    assert f"{path} is damaged: its bytes are not those that were written" in done.stderr
    assert f"--from {origin.folder}@{earlier}, or remove the damaged file and resume the run" in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.count("is damaged") == 1
    path.unlink()
    done = run_colluvium("resume", origin.folder, "--quiet")
    assert done.returncode == 0, done.stderr
    assert f"continuing after the end of stage {earlier!r}" in done.stderr


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.999])
def test_a_truncated_file_is_found(side, share):
    path = side[-1]
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    refused(side, "empty" if share == 0.0 else "bytes, and had " if share * len(whole) > seal.ROOM else "seal|bytes")


def test_a_longer_file_is_found(side):
    with side[-1].open("ab") as file:
        file.write(b"\0")
    refused(side, "bytes, and had ")


def test_what_is_no_checkpoint_is_refused_in_words(side):
    path = side[-1]
    whole = path.read_bytes()
    path.write_text("a letter\n" * 200, encoding="utf-8")
    refused(side, "does not begin with the seal")
    path.write_bytes(whole[seal.ROOM :])  # as versions before seals wrote it
    refused(side, "it has no seal: another program or an earlier version wrote it")
    content = bytearray(seal.ROOM + 100)
    seal.put_on(memoryview(content))
    path.write_bytes(content)
    refused(side, "is not a checkpoint, although it is as it was written")


def test_a_file_in_another_ones_place_is_refused(side, runs):
    scene, origin, name, path = side
    side_of_it = "discs" if name == "fdm.rank0" else "grid"
    shutil.copy(Origin(runs[side_of_it][1], SIDES[side_of_it][1]).path(SIDES[side_of_it][0]), path)
    refused(side, "is a checkpoint of .*: files were exchanged or renamed")
    first = scene.stage[0].name
    shutil.copy(origin.folder / f"{name}.{first}.h5", path)
    refused(side, f"at the end of stage {first!r}: files were exchanged or renamed")


def test_a_file_without_what_it_belongs_to_is_refused(side):
    checkpoint.save(side[-1], {"number": 1.0}, {"phase": restart.END})
    refused(side, "it has no version, process")


def changed(path, change):
    """Write a checkpoint anew, sealed, after change(file)."""
    image = io.BytesIO(path.read_bytes())
    with h5py.File(image, "r+") as file:
        change(file)
    seal.put_on(image.getbuffer())
    path.write_bytes(image.getvalue())


def put(name, value, place=...):
    """A change of an array in place."""

    def change(file):
        file["state"][name][place] = value

    change.__name__ = f"{name} {value}"
    return change


def instead(name, value):
    """A change of a whole field; value None: it is gone."""

    def change(file):
        del file["state"][name]
        if value is not None:
            file["state"][name] = value

    change.__name__ = f"{name} replaced by {'nothing' if value is None else value!r}"
    return change


GRID_WRONG = [
    (put("zone", 99, 0), "zone holds 99"),
    (put("zone", 1, 0), "zone does not hold every zone once"),
    (instead("zone", np.arange(16.0)), "zone holds float64"),
    (put("grid/velocity", np.nan, 3), "velocity holds NaN"),
    (instead("grid/velocity", np.zeros((3, 2))), r"velocity has the shape \(3, 2\) instead of \(25, 2\)"),
    (instead("grid/stress", np.zeros((7, 160))), "stress has the shape"),
    (put("grid/plastic", 999, (0, 0)), "plastic holds 999"),
    (instead("grid/plastic", None), "state.grid.plastic is missing"),
    (instead("grid/plastic", h5py.Empty("f8")), "plastic is missing"),
    (instead("grid/displacement", 3.0), "displacement is not an array"),
    (instead("grid/mass_age", np.zeros(4)), "mass_age is not a number"),
    (instead("grid/dt", -1.0), "dt is not a time step"),
    (instead("grid", 3.0), "state.grid is not a group"),
    (lambda file: file.attrs.pop("rows"), "attribute rows"),
]
DISCS_WRONG = [
    (put("discs/second", 4000, 0), "second holds 4000"),
    (put("discs/first", 7, 0), "first is not below second"),
    (put("discs/kind", 77, 0), "kind holds 77"),
    (put("discs/parts", 999, (-1, 1)), "parts holds runs beyond"),
    (put("discs/disc", np.inf, (2, 0)), "disc holds NaN or infinite"),
    (put("discs/disc", -0.1, (2, 5)), "radius holds numbers that are not positive"),
    (put("discs/disc", 0.0, (2, 6)), "mass holds numbers that are not positive"),
    (instead("discs/load", np.zeros((8, 3))), "load has the shape"),
    (instead("discs/normal", np.zeros(1)), "normal has the shape"),
    (instead("discs/shear", h5py.Empty("f8")), "shear is missing"),
    (put("discs/bond_state", 9, 0), "state of bonds holds 9"),
    (put("discs/clumps/member", 70, 0), "clumps.member holds 70"),
    (put("discs/clumps/body", 5, 0), "clumps.body holds 5"),
    (put("discs/clumps/start", 9, 1), "clumps.start does not divide"),
    (put("model/material", 7, 0), "material holds 7"),
    (put("model/density", -1.0, 0), "density holds numbers"),
    (instead("model/ring", 900), "900 of 8 discs are on the ring"),
    (instead("model/law/spring/normal", np.ones(5)), "5 kinds of pairs"),
    (instead("discs/walls/ends", np.zeros((2, 4))), "walls"),
    (instead("discs/walls/rolled", np.zeros((8, 1))), "walls.rolled does not fit"),
    (lambda file: file["state"].create_dataset("discs/thing", data=1.0), "state.discs.thing is unknown"),
]


@pytest.mark.parametrize(("change", "words"), GRID_WRONG, ids=lambda value: getattr(value, "__name__", ""))
def test_a_grid_that_no_step_can_be_taken_with_is_refused(runs, tmp_path, change, words):
    wrong(runs["grid"], "grid", tmp_path / "run", change, words)


@pytest.mark.parametrize(("change", "words"), DISCS_WRONG, ids=lambda value: getattr(value, "__name__", ""))
def test_discs_that_no_step_can_be_taken_with_are_refused(runs, tmp_path, change, words):
    wrong(runs["discs"], "discs", tmp_path / "run", change, words)


def wrong(run, side, out, change, words):
    """A sealed checkpoint after `change` ends the run that continues from it, in words that name it."""
    scene, folder = run
    name, stage = SIDES[side]
    shutil.copytree(folder, out)
    path = out / f"{name}.{stage}.h5"
    changed(path, lambda file: None)
    restart.load(scene, Origin(out, stage), name)
    changed(path, change)
    with pytest.raises(exits.EnvironmentFailed, match=words) as error:
        colluvium.resume(out)
    assert str(path) in str(error.value)
