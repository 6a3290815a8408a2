"""scripts/one_node_slurm.py: files of a cluster of one node, and where Slurm is installed, a sweep that its workers compute."""

import os
import re

import one_node_slurm
import pytest
import yaml

from tests.commands import run_script


def test_the_node_has_the_processors_of_this_machine_and_free_ports(tmp_path):
    ports = one_node_slurm.free_ports(2)
    assert len(set(ports)) == 2
    text = one_node_slurm.slurm_conf(tmp_path, "node", ports, 2, 4000)
    assert "NodeName=node NodeAddr=127.0.0.1 CPUs=2 RealMemory=4000" in text
    assert f"SlurmctldPort={ports[0]}" in text
    assert f"SlurmdPort={ports[1]}" in text
    assert not re.findall(r"[{}]", text)
    paths = [line.partition("=")[2] for line in text.splitlines() if line.startswith(("State", "SlurmdSpool", "SlurmctldLog"))]
    assert all(path.startswith(str(tmp_path)) for path in paths)


def test_workers_have_a_core_for_each_process_of_a_run(tmp_path):
    found = yaml.safe_load(one_node_slurm.jobqueue_yaml(tmp_path, 2))["jobqueue"]["slurm"]
    assert (found["cores"], found["processes"]) == (2, 1)
    assert found["interface"] == "lo"


def test_what_is_not_installed_is_named(monkeypatch, capsys):
    monkeypatch.setattr(one_node_slurm.shutil, "which", lambda name, path=None: None)
    assert one_node_slurm.main([]) == 3
    assert "not installed: munged, slurmctld, slurmd" in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.trial
@pytest.mark.skipif(bool(one_node_slurm.lacking()) or os.geteuid() != 0, reason="needs slurm-wlm, munge and root")
def test_slurm_computes_a_sweep_and_nothing_is_left(tmp_path):
    done = run_script("one_node_slurm.py", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "4 of 4:" in done.stderr + done.stdout
    assert re.search(r"all +dask-wor", done.stdout)
    rows = (tmp_path / "sweep" / "points.csv").read_text().splitlines()
    assert len(rows) == 5
    for line in os.popen("ps -eo args").read().splitlines():
        assert str(tmp_path) not in line
