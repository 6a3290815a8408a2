"""Key files: readable by their owner only from the moment they exist; the command that makes, lists and revokes them."""

import os
import stat
import subprocess
import sys

import pytest

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.wire import keys
from tests.commands import run_colluvium


@pytest.fixture
def folder(tmp_path):
    """A key folder with the keys of `office`; its file is tmp_path/office.key."""
    keys.new(tmp_path / "keys", "office", tmp_path / "office.key")
    return tmp_path / "keys"


def mode(path):
    return stat.S_IMODE(path.lstat().st_mode)


def test_files_are_of_their_owner_only_whatever_the_umask(tmp_path):
    before = os.umask(0)
    try:
        keys.new(tmp_path / "keys", "office", tmp_path / "office.key")
        keys.local_secret(tmp_path / "keys")
    finally:
        os.umask(before)
    found = {path.relative_to(tmp_path).as_posix(): mode(path) for path in tmp_path.rglob("*")}
    files = ("office.key", "keys/server.key", "keys/local.key", "keys/clients/office.key")
    assert found == dict.fromkeys(("keys", "keys/clients"), 0o700) | dict.fromkeys(files, 0o600)


def test_no_file_is_ever_open_to_others_for_a_moment(tmp_path, monkeypatch):
    """The mode is an argument of the call that makes the file, which neither follows a link nor takes a file that is there."""
    made = []
    real = os.open

    def watched(path, flags, mode=0o777, **more):
        if flags & os.O_CREAT:
            made.append((flags & os.O_EXCL, flags & os.O_NOFOLLOW, mode))
        return real(path, flags, mode, **more)

    monkeypatch.setattr(os, "open", watched)
    keys.new(tmp_path / "keys", "office", tmp_path / "office.key")
    assert made == [(os.O_EXCL, os.O_NOFOLLOW, 0o600)] * 3


def test_both_sides_of_a_key_fit_and_the_continuum_does_not_keep_the_secret_of_the_client(folder, tmp_path):
    own = keys.client_key(tmp_path / "office.key")
    (client,) = keys.clients_of(folder)
    assert (client.name, client.public, client.gate, client.revoked) == ("office", own.public, own.gate, False)
    assert own.server == keys.server_keys(folder).public
    assert own.secret.decode() not in (folder / "clients" / "office.key").read_text()
    assert len({own.gate, *(keys.local_secret(folder) for _ in range(2))}) == 2


@pytest.mark.parametrize("path", ["office.key", "keys/server.key", "keys/local.key", "keys/clients/office.key", "keys"])
def test_what_others_can_use_is_refused(folder, tmp_path, path):
    keys.local_secret(folder)
    (tmp_path / path).chmod(0o750)

    def use():
        keys.client_key(tmp_path / "office.key")
        keys.server_keys(folder)
        keys.clients_of(folder)
        keys.local_secret(folder)

    with pytest.raises(EnvironmentFailed, match=r"is open to other users \(mode 750\): chmod [67]00"):
        use()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file away")
def test_a_file_of_another_user_is_refused(folder):
    os.chown(folder / "server.key", 12345, 12345)
    with pytest.raises(EnvironmentFailed, match=r"belongs to another user \(id 12345\)"):
        keys.server_keys(folder)


def test_links_and_pipes_are_not_followed(folder, tmp_path):
    (tmp_path / "link.key").symlink_to(tmp_path / "office.key")
    with pytest.raises(EnvironmentFailed, match="cannot read"):
        keys.client_key(tmp_path / "link.key")
    os.mkfifo(tmp_path / "pipe.key", 0o600)
    with pytest.raises(EnvironmentFailed, match="is not a file"):
        keys.client_key(tmp_path / "pipe.key")
    (tmp_path / "planted").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(EnvironmentFailed, match="exists already"):
        keys.new(folder, "other", tmp_path / "planted")
    assert not (tmp_path / "elsewhere").exists()


@pytest.mark.parametrize("damage", [b"", b"name = 5\n", b"\xff\xfe", b'gate = "zz"\n', b"x" * 70_000])
def test_a_damaged_file_is_refused_in_words(folder, tmp_path, damage):
    (tmp_path / "office.key").write_bytes(damage)
    with pytest.raises(EnvironmentFailed, match="is not a whole key file"):
        keys.client_key(tmp_path / "office.key")


def test_processes_that_begin_together_have_one_secret(tmp_path):
    code = "from coupler_protocol.wire import keys; print(keys.local_secret(keys.folder_of()).hex())"
    started = [
        subprocess.Popen(
            [sys.executable, "-c", code],
            env=os.environ | {keys.VARIABLE: str(tmp_path / "keys")},
            stdout=subprocess.PIPE,
            text=True,
        )
        for _ in range(4)
    ]
    said = [process.communicate(timeout=60)[0].strip() for process in started]
    assert len(set(said)) == 1
    assert len(said[0]) == 2 * keys.SECRET


def test_the_command_makes_lists_and_revokes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["--keys", tmp_path / "keys"]
    made = run_colluvium("keys", "new", "office", *words)
    assert made.returncode == 0
    assert "--key office.key" in made.stdout
    assert mode(tmp_path / "office.key") == 0o600
    own = keys.client_key("office.key")
    for again, why in (
        (["office"], "'office' exists already"),
        (["../x"], "is not a name of a key"),
        ([".hidden"], "not a name"),
    ):
        done = run_colluvium("keys", "new", *again, *words)
        assert (done.returncode, why in done.stderr) == (4, True), done.stderr
    assert run_colluvium("keys", "new", "lab", *words).returncode == 0
    assert run_colluvium("keys", "revoke", "office", *words).returncode == 0
    listed = run_colluvium("keys", "list", *words).stdout
    assert listed.splitlines()[0].startswith("2 keys in")
    assert [row.split()[0] for row in listed.splitlines()[1:]] == ["lab", "office"]
    assert listed.splitlines()[2].endswith("revoked")
    for secret in (own.secret.decode(), own.gate.hex()):
        assert secret not in made.stdout + listed
    refused = run_colluvium("keys", "revoke", "office", *words)
    assert (refused.returncode, "there is no key 'office'" in refused.stderr, "keys: lab" in refused.stderr) == (4, True, True)
    assert "'office' was revoked: choose another name" in run_colluvium("keys", "new", "office", *words).stderr
