"""configs/quick_lab.toml from the command line: an oedometer has the modulus of its contacts and loses no energy."""

import json
import signal
import subprocess
import time

import numpy as np
import pytest

from colluvium.forecast.packing_moduli import estimate
from colluvium.lab.curves import COLUMNS, read_csv
from coupler_protocol import exits
from coupler_protocol.scene.reader import read_scene
from tests.commands import command, run_colluvium

ONE = ("--set", "lab.seeds=[1]", "--set", "lab.confinement=[5e4]")


def laboratory(kind, configs, out, *more):
    done = run_colluvium("lab", kind, configs / "quick_lab.toml", "--out", out, *more)
    assert done.returncode == 0, done.stderr
    return done


def wait_for(there, seconds=100.0):
    """Waits until `there()` is true."""
    deadline = time.monotonic() + seconds
    while not there():
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.fixture(scope="module")
def oedometer(tmp_path_factory, configs):
    out = tmp_path_factory.mktemp("lab") / "oedometer"
    laboratory("oedometer", configs, out, *ONE)
    return out


def test_the_modulus_is_that_of_the_contacts_and_the_work_is_given_back(oedometer, configs):
    """Bonds hold: no energy is lost, both moduli agree but for contacts that close, below those of 4.2 contacts a disc."""
    (row,) = json.loads((oedometer / "answers.json").read_text())["trials"]
    expected = estimate(read_scene(configs / "quick_lab.toml").discs)
    assert row["bonds_broken"] == 0
    assert 0.5 * expected.constrained < row["M"] < expected.constrained
    assert row["M_unload"] == pytest.approx(row["M"], rel=0.06)
    k0 = (expected.bulk - expected.shear) / expected.constrained
    assert row["K0"] == pytest.approx(k0, abs=0.12)
    assert abs(row["lost_share"]) < 0.02
    assert row["side_strain"] < 0.1 * 1e5 / row["M"]  # of the axial strain


def test_curves_pictures_and_a_page_are_written(oedometer):
    (path,) = (oedometer / "curves").glob("*.csv")
    found = read_csv(path)
    assert list(found) == list(COLUMNS)
    assert np.diff(found["step"]).min() > 0.0
    assert (oedometer / "soil_curves.png").stat().st_size > 10000
    assert "data:image/png" in (oedometer / "report.html").read_text()


def test_a_finished_laboratory_computes_nothing_again(oedometer, configs):
    trial = next((oedometer / "trials").iterdir()) / "run.json"
    before = trial.stat().st_mtime_ns
    again = laboratory("oedometer", configs, oedometer, "--no-pictures", "--json", *ONE)
    assert trial.stat().st_mtime_ns == before
    assert json.loads(again.stdout)["kind"] == "oedometer"


def test_a_dry_run_says_what_is_left(oedometer, configs):
    said = laboratory("oedometer", configs, oedometer, "--dry-run", "--set", "lab.confinement=[5e4]").stdout
    assert "2 trials, 1 of them done" in said
    assert "soil.50kPa.seed2: about" in said


@pytest.mark.long
def test_an_interrupted_laboratory_continues(oedometer, configs, tmp_path):
    """Ctrl-C in a trial: code 130 and no answer. The same command then has the answers of a straight one, bit for bit."""
    words = command("colluvium.cli", "lab", "oedometer", configs / "quick_lab.toml", "--out", tmp_path, *ONE, "--quiet")
    with subprocess.Popen(words, start_new_session=True) as process:
        folder = tmp_path / "trials" / "soil.50kPa.seed1"
        wait_for(lambda: any(folder.glob("dem*")))
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == exits.INTERRUPTED
    assert not (tmp_path / "answers.json").exists()
    laboratory("oedometer", configs, tmp_path, *ONE, "--no-pictures")
    assert (tmp_path / "answers.json").read_bytes() == (oedometer / "answers.json").read_bytes()


@pytest.mark.long
def test_stones_stiffen_the_soil_of_a_coupled_scene(configs, tmp_path):
    """Rigid stones carry 45 % of the area: clumps are stiffer than the soil alone, clusters of stiff discs as well."""
    lab = {"seeds": "[1]", "confinement": "[1e5]", "width": "40.0", "samples": '["soil", "clump", "cluster"]'}
    words = [word for key, value in lab.items() for word in ("--set", f"lab.{key}={value}")]
    done = run_colluvium("lab", "oedometer", configs / "paper_slope.toml", "--out", tmp_path, "--no-pictures", *words)
    assert done.returncode == 0, done.stderr
    modulus = {row["sample"]: row["M"] for row in json.loads((tmp_path / "answers.json").read_text())["trials"]}
    assert modulus["clump"] > 1.2 * modulus["soil"]
    assert modulus["cluster"] > 1.2 * modulus["soil"]


@pytest.mark.long
@pytest.mark.parametrize("kind", ["biaxial", "shear", "brazilian"])
def test_the_other_tests(kind, configs, tmp_path):
    """Confining stress kept within 2 % on average, work spent on what there is, more strength under more stress."""
    laboratory(kind, configs, tmp_path, "--half-rate", "--no-pictures", "--set", "lab.seeds=[1]")
    found = json.loads((tmp_path / "answers.json").read_text())
    means = found["samples"]["soil"]["means"]
    for row in found["trials"]:
        assert row["stored_share"] + row["lost_share"] + row["kinetic_share"] == pytest.approx(1.0)
        assert row["lost_share"] > -0.02
        assert abs(row.get("side_bias", 0.0)) < 0.02
    if kind != "brazilian":
        assert means[1]["peak_axial"]["mean"] > means[0]["peak_axial"]["mean"] > 0.0
    else:
        assert means[0]["tension"]["mean"] > 1e4
    assert len(found["rates"]) > 5
