"""`colluvium fos` on a coupled scene: rounds of trials, an interrupted search, and no trial twice."""

import json
import signal
import subprocess

import pytest

from colluvium.running.processes import as_toml
from colluvium.safety import mechanism
from tests.colluvium.safety.small_slope import tables
from tests.commands import command, run_colluvium
from tests.same_bits import differing

pytestmark = pytest.mark.long

SOIL = {  # scripts/safety_of_window.py, with bonds for discs of 0.12 m in place of 0.03 m: c is proportional to bond / radius
    "density": 2000.0,
    "spring": {"normal": 2.62e9, "shear": 2.03e8},
    "friction": {"coefficient": 0.73},
    "bond": {"tension": 4 * 5970.0, "shear": 4 * 13930.0},
    "rolling": {"coefficient": 0.089},
}


@pytest.fixture(scope="module")
def searched(tmp_path_factory, configs):
    """(scene, folder, what was printed) of a search that was interrupted in its first round and then ended."""
    folder = tmp_path_factory.mktemp("safety")
    scene, out = folder / "slope.toml", folder / "out"
    data = tables(configs, soil=SOIL)
    data["fos"] = {"resolution": 0.25, "bracket": [2.4, 2.7]}
    scene.write_text(as_toml(data))
    words = command("colluvium.cli", "fos", scene, "--out", out)
    first = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    for line in first.stderr:
        if "trials at the same time" in line:
            break
    first.send_signal(signal.SIGINT)
    assert "the same command continues" in first.communicate(timeout=120)[1]
    assert first.returncode == 130
    done = run_colluvium("fos", scene, "--out", out)
    assert done.returncode == 0, done.stderr
    return scene, out, done


def test_an_interrupted_search_continues(searched):
    _, _, done = searched
    assert "the grid alone: computed before" in done.stderr
    assert "the coupled slope at rest: computed before" in done.stderr


def test_a_window_like_its_zones_has_their_factor(searched):
    """The soil set fails within the 10 % around the grid's factor that are tried first (`pytest -m trial`: within 5 %)."""
    _, out, done = searched
    found = json.loads((out / "fos.json").read_text())
    alone, coupled = found["meshes"][-1]["value"], found["coupled"]
    assert [row["verdict"] for row in coupled["trials"]] == ["rests", "fails"]
    assert (coupled["low"], coupled["high"]) == pytest.approx((0.9 * alone, 1.1 * alone))
    assert coupled["trials"][1]["spans"]["similarity"][-1] > 0.9
    assert f"grid and discs: factor of safety {coupled['value']:.3f}" in done.stdout


def test_the_picture_shows_what_moved_in_the_trial(searched):
    from colluvium import open_run

    _, out, _ = searched
    failed = json.loads((out / "fos.json").read_text())["coupled"]["trials"][1]
    assert (out / "coupled_mechanism.png").read_bytes().startswith(b"\x89PNG")
    with open_run(out / "trials" / failed["folder"]) as run:
        assert len(run.frames) == 2
        ground, discs = mechanism.moved(run), mechanism.moved(run, 1)
        assert max(abs(discs).max(), abs(ground).max()) == pytest.approx(failed["max_displacement"], rel=0.2)
        chains, stones = mechanism.carried(run, 1)
        assert chains.chains > 0
        assert len(stones) == 0


def test_only_what_is_missing_is_computed_again(searched):
    """One trial loses its last file: this one is computed again, to the same bits, and no other."""
    scene, out, _ = searched
    before = json.loads((out / "fos.json").read_text())["coupled"]
    rested, failed = (out / "trials" / row["folder"] for row in before["trials"])
    (failed / "trial.json").unlink()
    kept = failed.rename(failed.with_name("kept"))
    stamp = (rested / "trial.json").stat().st_mtime_ns
    done = run_colluvium("fos", scene, "--out", out, "--no-pictures")
    assert done.returncode == 0, done.stderr
    assert (rested / "trial.json").stat().st_mtime_ns == stamp
    after = json.loads((out / "fos.json").read_text())["coupled"]
    assert [row["spans"] for row in after["trials"]] == [row["spans"] for row in before["trials"]]
    for name in ("fdm.rank0.vtkhdf", "dem.rank1.vtkhdf"):
        assert differing(kept / name, failed / name) == [], name


@pytest.mark.trial
def test_a_window_like_its_zones_has_their_factor_within_5_percent(configs, tmp_path):
    scene = tmp_path / "slope.toml"
    data = tables(configs, soil=SOIL)
    data["fos"] = {"resolution": 0.03}
    scene.write_text(as_toml(data))
    done = run_colluvium("fos", scene, "--out", tmp_path / "out", "--no-pictures")
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "out" / "fos.json").read_text())
    assert found["coupled"]["value"] == pytest.approx(found["meshes"][-1]["value"], rel=0.05)
