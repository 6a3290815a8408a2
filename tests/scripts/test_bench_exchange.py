"""The benchmark of the exchange reports all it promises, and its counts are those of the frames (no seconds asserted)."""

import json
import shutil
import socket
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import lan
import pytest
from bench import lan_steps, link_ends, links
from bench.coupled_step import LONGER, coupled, stages_of, with_measured_stages
from bench.stream_loops import raw_trips
from bench.timing_rows import row
from bench_exchange import lan_tables, link_tables
from pages import plain

from coupler_protocol.compiled import lane
from coupler_protocol.scene.reader import read_scene
from coupler_protocol.wire import messages
from coupler_protocol.wire.lanes import Lanes, Peer
from tests.commands import run_script

NAMES = ["coupled step", "kernels of the grid", "kernels of the discs", "wire"]
BY_STEPS = ["grid alone, one by one", "discs alone, one by one", "link", "encrypted link", "bound: slower kernels + wire"]
TRACE = """
10 access("/trips-of-50-begin", F_OK) = -1 ENOENT (No such file or directory)
10 write(7<TCP:[127.0.0.1:40->127.0.0.1:41]>, "CLVM"..., 1200) = 1200
10 read(7<TCP:[127.0.0.1:40->127.0.0.1:41]>, 0x7f, 1008) = -1 EAGAIN (Resource temporarily unavailable)
10 sched_yield() = 0
11 poll([{fd=4<UNIX-STREAM:[11->12]>, events=POLLIN}], 1, -1 <unfinished ...>
10 read(7<TCP:[127.0.0.1:40->127.0.0.1:41]>,  <unfinished ...>
11 <... poll resumed>) = 1 ([{fd=4, revents=POLLIN}])
10 <... read resumed>"CLVM"..., 1008) = 1008
11 sendto(4<UNIX-STREAM:[11->12]>, "x", 30, 0, NULL, 0) = 30
11 write(9<anon_inode:[eventfd]>, "\\1", 8) = 8
10 access("/trips-of-50-end", F_OK) = -1 ENOENT (No such file or directory)
10 write(7<TCP:[127.0.0.1:40->127.0.0.1:41]>, "CLVM"..., 1200) = 1200
""".strip().splitlines()


def test_calls_that_carry_bytes_are_counted_apart_between_the_marks():
    calls = links.calls_between(TRACE, *(mark.format(50) for mark in link_ends.MARKS.values()))
    assert (calls.carried, calls.others) == (3, 4)
    assert calls.sent == {"TCP": 1200, "UNIX": 30}


@pytest.fixture
def raw():
    """Lanes of both ends of a plain stream, of the continuum and of the discs, and their loops of some trips."""
    peers = (Peer(1, 1, 3), messages.FORCE, messages.VELOCITY), (Peer(0, 1, 3), messages.VELOCITY, messages.FORCE)
    ends = [Lanes(link_ends.SESSION, [peer], hears, says) for peer, hears, says in peers]
    for end, connection in zip(ends, socket.socketpair(), strict=True):
        end.open(end.peers[0].peer, connection)
    yield (
        ends,
        [partial(raw_trips, end.wire, 4, answers, True) for end, answers in zip(ends, (True, False), strict=True)],
    )
    for end in ends:
        end.close_all()


def test_the_plain_loop_makes_trips_with_whole_frames(raw):
    ends, (continuum, discs) = raw
    ends[1].wire.said[5] = 2.5  # the first number after the header
    with ThreadPoolExecutor() as beside:
        made = beside.submit(continuum)
        assert discs() == made.result() == 4
    assert ends[0].wire.heard[5] == 2.5
    assert links.frame_bytes(3) == sum(4 * len(end.wire.outbox) for end in ends)


@pytest.mark.parametrize(("word", "trips"), [(None, 1), (lane.CHECKSUM, 0), (lane.SEQUENCE, 0), (2, 0), (lane.HEADER_WORDS, 0)])
def test_the_plain_loop_checks_as_a_lane_does(raw, word, trips):
    """Checksum, sequence, session and payload: one bit of a word of a frame is flipped."""
    (grid, discs), (continuum, _) = raw
    lane.put(discs.wire, 0)
    frame = bytearray(grid.sockets[0].recv(1 << 16))
    assert len(frame) == grid.wire.in_at[1]
    if word is not None:
        frame[4 * word] ^= 1
    discs.sockets[0].sendall(frame)
    discs.sockets[0].shutdown(socket.SHUT_WR)
    assert continuum() == trips


def test_tables_have_a_line_for_every_way_and_size():
    rows = [
        row(way, {"rim_nodes": n}, [1e-5 * n * (3.0 if way == "encrypted link" else 1.0)], "s", {})
        | {"over_raw": 1.0, "sleeps": 0.5, "bytes": 208.0 + 40 * n, "carrying_calls": 4.0, "other_calls": 2.0}
        for way in links.WORDS
        for n in links.SIZES
    ]
    tables, last = link_tables(rows)
    times, needs = (plain(lines, columns).splitlines() for columns, lines in tables)
    assert (len(times), len(needs)) == (1 + len(links.WORDS), 2 + len(links.WORDS))
    assert last.startswith("the encrypted link takes 3.0, 3.0, 3.0, 3.0 times the link of")
    assert "not installed" not in last
    assert needs[1].split()[-4:] == needs[-1].split()[-4:] == ["2,208", "4,208", "20,208", "200,208"]
    assert "not installed" in link_tables([{key: value for key, value in r.items() if key != "bytes"} for r in rows])[1]


def test_a_lan_is_compared_with_the_slower_side_and_its_round_trip():
    r = row("coupled step over a LAN, lane", {"rim_nodes": 46, "delay_ms": 0.5}, [1.5e-3], "s/step", {})
    r |= {"bound": 1.2e-3, "round_trip": 1.1e-3, "round_trip_encrypted": 1.4e-3, "exchange_every": 1}
    ((columns, lines),), _ = lan_tables([r])
    assert plain(lines, columns).splitlines()[1].split() == ["0.5", "lane", "1,500", "1,100", "1,400", "1,200", "1.25", "1"]


@pytest.mark.long
@pytest.mark.skipif(shutil.which("strace") is None, reason="strace is not installed")
def test_an_exchange_over_a_lane_needs_four_calls_and_the_bytes_of_both_frames():
    found = links.traced("lane", (3, 50), 20)
    assert {nodes: (row["carrying_calls"], row["bytes"]) for nodes, row in found.items()} == {
        nodes: (4.0, links.frame_bytes(nodes)) for nodes in (3, 50)
    }


@pytest.mark.trial
@pytest.mark.long
@pytest.mark.parametrize("way", links.WAYS)
def test_every_way_makes_its_trips(way):
    found = links.exchanges(way, (3, 5000), 5, 1)
    assert found.keys() == {3, 5000}
    assert all(end["seconds"][0] > 0.0 for ends in found.values() for end in ends)


@pytest.mark.trial
@pytest.mark.long
@pytest.mark.skipif(bool(lan.missing()), reason=f"no LAN: {lan.missing()}")
def test_a_coupled_step_over_a_lan_takes_its_round_trip(configs, tmp_path, monkeypatch):
    monkeypatch.setattr(lan_steps, "DELAYS", (2e-3,))
    monkeypatch.setattr(lan_steps, "SECONDS", 0.2)
    original = read_scene(configs / "quick_slope.toml", [])
    coupled(with_measured_stages(original, 20, 1), tmp_path / "begun")
    sides = {"kernels": (1e-6, 1e-6), "one by one": (1e-6, 1e-6)}
    rows = lan_steps.rows_of_lan(original, tmp_path / "begun", tmp_path, 10, sides, 1, {})
    assert [row["exchange_every"] for row in rows] == [1, 1, lan_steps.EVERY]
    assert not any(row.get("fell_back") for row in rows)
    for name, found in zip(lan_steps.FORMS, rows, strict=True):
        stage = stages_of(tmp_path / f"{lan_steps.DELAYS[0]:g} {name}")[-1]
        steps = lan_steps.steps_of(lan_steps.DELAYS[0], found["exchange_every"]) * LONGER
        exchanges = stage.get("exchanges", stage["steps"])
        assert exchanges >= steps / found["exchange_every"]
        assert sum(stage["seconds"][part] for part in ("continuum", "waiting", "recording")) >= 4e-3 * (exchanges - 1)
        assert found["round_trip"] >= 4e-3


@pytest.mark.trial
@pytest.mark.long
def test_all_times_of_a_step_are_measured(tmp_path, configs):
    words = [configs / "quick_slope.toml", "--step", "--steps", "1000", "--repeats", "1", "--json", tmp_path / "rows.json"]
    done = run_script("bench_exchange.py", *words, "--page", tmp_path / "page.md", timeout=200)
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert [row["name"] for row in rows][:9] == NAMES + BY_STEPS
    assert [row["name"] for row in rows][-1] == "coupled step with frames over without"
    assert "recording stalls the loop by" in done.stdout
    assert all(row["value"] > 0.0 for row in rows)
    assert all(row["companion"]["triad_GB_per_s"] > 0.0 for row in rows)
    assert {"name", "size", "threads", "value", "unit", "repeats", "spread", "companion", "note"} <= rows[0].keys()
    assert "<!-- begin exchange -->" in (tmp_path / "page.md").read_text()
