"""Folders of sockets go with their process: at its end, or when the next one begins."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from coupler_protocol.wire.link_tcp import LOCAL, HubTransport
from coupler_protocol.wire.socket_folder import ALIVE, SocketFolder

HUB = """
from coupler_protocol.wire.link_tcp import LOCAL, HubTransport
hub = HubTransport(LOCAL)
print(hub.folder, flush=True)
input()
hub.close()
"""


@pytest.fixture(autouse=True)
def _temporary_files(tmp_path, monkeypatch):
    """A folder for temporary files whose path is short enough for sockets."""
    with tempfile.TemporaryDirectory(dir="/tmp", prefix="c") as folder:
        monkeypatch.setattr(tempfile, "tempdir", folder)
        monkeypatch.setenv("TMPDIR", folder)
        yield


def aged(folder):
    os.utime(folder, (1e9, 1e9))
    return Path(folder)


def test_a_killed_process_leaves_its_folder_to_the_next_one_and_a_live_one_keeps_it():
    options = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    killed, live = (subprocess.Popen([sys.executable, "-c", HUB], **options) for _ in range(2))
    left, kept = (aged(process.stdout.readline().strip()) for process in (killed, live))
    killed.kill()
    killed.communicate()
    assert (left / "link").exists()
    hub = HubTransport(LOCAL)
    assert not left.exists()
    assert (kept / "link").exists()
    hub.close()
    assert not Path(hub.folder).exists()
    live.communicate("\n", timeout=60)
    assert not kept.exists()


def test_only_old_folders_of_this_user_without_a_holder_are_removed():
    root = Path(tempfile.gettempdir())
    folders = {name: root / f"colluvium-link-{name}" for name in ("old", "young", "empty", "used", "foreign")}
    for folder in folders.values():
        folder.mkdir()
    (folders["used"] / "link").touch()  # without a lock: of another version
    for name in ("old", "young", "foreign"):
        (folders[name] / ALIVE).touch()
    for name in folders.keys() - {"young"}:
        aged(folders[name])
    (root / "colluvium-link-to").symlink_to(folders["young"])
    left = {"young", "used", "foreign"}
    if os.geteuid() == 0:
        os.chown(folders["foreign"], 12345, 12345)
    else:
        left.remove("foreign")
    SocketFolder().remove()
    assert {name for name, folder in folders.items() if folder.exists()} == left
    assert (root / "colluvium-link-to").is_symlink()
