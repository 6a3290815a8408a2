"""What `colluvium doctor` says about keys, ports and the other side; it tells no secret."""

import contextlib
import re
import socket
import threading

import pytest

from colluvium.doctor import link
from colluvium.doctor.findings import LOOK, OK, WRONG, any_wrong, lines
from coupler_protocol.wire import admission, gate_words, keys, link_tcp, passing
from tests.commands import run_colluvium


@pytest.fixture
def folder(tmp_path):
    """A key folder with `office`, whose file is in tmp_path."""
    keys.new(tmp_path / "keys", "office", tmp_path / "office.key")
    return tmp_path / "keys"


@pytest.fixture
def continuum():
    """A function that opens the continuum's end with keys of a folder (None: of this user; "": --insecure): its endpoint."""
    with contextlib.ExitStack() as opened:

        def begin(folder):
            rule = admission.rule_of("tcp://127.0.0.1:0", True, folder or None, folder == "")
            found = link_tcp.HubTransport("tcp://127.0.0.1:0", rule)
            opened.callback(found.close)
            return found.endpoint

        yield begin


def said(endpoint, file=None, insecure=False):
    """(levels that are not OK, all lines) about the other side at an endpoint."""
    found = list(link.other(endpoint, file, insecure))
    return {finding.level for finding in found} - {OK}, "\n".join(lines(found))


def test_a_continuum_with_keys_lets_the_key_pass_and_tells_version_clock_and_time(continuum, folder, tmp_path):
    levels, text = said(continuum(folder), tmp_path / "office.key")
    assert levels == set()
    assert "lets this machine pass with the key 'office'" in text
    assert re.search(r"round trip    [\d.]+ ms to connect, [\d.]+ ms for a question and its answer", text)
    assert "protocol 4 on both sides" in text
    assert "they agree within 2 s" in text


def test_a_continuum_of_this_user_needs_no_key(continuum):
    assert said(continuum(None))[0] == set()


def test_an_open_continuum_is_worth_a_look(continuum):
    levels, text = said(continuum(""), insecure=True)
    assert levels == {LOOK}
    assert "everybody can take part" in text


def test_who_is_refused_is_told_why(continuum, folder, tmp_path, monkeypatch):
    endpoint = continuum(folder)
    monkeypatch.setattr(link_tcp, "is_loopback", lambda endpoint: False)
    levels, text = said(endpoint)
    assert levels == {WRONG}
    assert "takes clients with a key only: name the key file of this machine with --key FILE" in text
    keys.new(tmp_path / "others", "office", tmp_path / "others.key")
    assert "has another key than" in said(endpoint, tmp_path / "others.key")[1]
    assert "there is no key file" in said(endpoint, tmp_path / "none.key")[1]
    keys.revoke(folder, "office")
    assert "has revoked the key 'office'" in said(endpoint, tmp_path / "office.key")[1]


def test_other_versions_and_clocks_are_told(continuum, folder, tmp_path, monkeypatch):
    endpoint = continuum(folder)
    told = gate_words.about
    for change, level, words in (
        (
            {"package": "0.3.0\n", "protocol": 5},
            WRONG,
            r"version       colluvium 0.3.0\\n, protocol 5 there; .*: install the same",
        ),
        ({"time": 1e9}, LOOK, r"clocks        the clock there is \d+ s behind this one"),
        ({"time": float("nan")}, LOOK, "clocks        the clock there is nan s"),
    ):
        monkeypatch.setattr(gate_words, "about", lambda data, change=change: told(data)._replace(**change))
        levels, text = said(endpoint, tmp_path / "office.key")
        assert levels == {level}
        assert re.search(words, text), text


def test_nobody_another_program_and_silence_are_told_apart(monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        threading.Thread(target=lambda: server.accept()[0].sendall(b"HTTP/1.1 400\r\n"), daemon=True).start()
        assert "is not a continuum of this version: it does not speak as colluvium does" in said(f"tcp://127.0.0.1:{port}")[1]
        monkeypatch.setattr(passing, "PATIENCE", 0.2)
        assert "does not answer: check the address and the firewall" in said(f"tcp://127.0.0.1:{port}")[1]
    assert "no program listens at" in said(f"tcp://127.0.0.1:{port}")[1]
    assert "nowhere.invalid has no address" in said("tcp://nowhere.invalid:5555")[1]
    assert "is not of the form tcp://HOST:PORT" in said("tcp://office")[1]


def test_ports_are_free_taken_or_not_of_this_machine():
    with socket.create_server(("127.0.0.1", 0)) as server:
        taken = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        assert [finding.level for finding in link.port(taken)] == [LOOK]
    assert [finding.level for finding in link.port(taken)] == [OK]
    for wrong in ("tcp://203.0.113.7:5555", "5555", "tcp://127.0.0.1:99999"):
        assert [finding.level for finding in link.port(wrong)] == [WRONG]


def test_keys_that_others_can_read_are_wrong(folder, tmp_path):
    assert [finding.level for finding in link.key_files(folder, tmp_path / "office.key")] == [OK, OK]
    (tmp_path / "office.key").chmod(0o644)
    found = list(link.key_files(folder, tmp_path / "office.key"))
    assert [finding.level for finding in found] == [OK, WRONG]
    assert "chmod 600" in found[1].found
    folder.chmod(0o755)
    assert any_wrong(link.key_files(folder, None))
    assert [finding.level for finding in link.key_files(tmp_path / "none", None)] == [OK]


def test_the_command_ends_with_a_code_and_tells_no_secret(continuum, folder, tmp_path):
    endpoint = continuum(folder)
    words = ["doctor", "--out", tmp_path / "run", "--keys", folder, "--key", tmp_path / "office.key", "--other"]
    for more, code in (([endpoint], 0), (["tcp://127.0.0.1:1"], 4), ([endpoint, "--json"], 0)):
        done = run_colluvium(*words, *more)
        assert done.returncode == code, done.stdout
        secrets = [path.read_text() for path in (tmp_path / "office.key", folder / "server.key")]
        values = [value for text in secrets for value in re.findall(r'(?:secret|gate|public|server) = "(.*)"', text)]
        assert len(values) == 6
        assert [value for value in values if value in done.stdout + done.stderr] == []
    assert not (tmp_path / "run").exists()
