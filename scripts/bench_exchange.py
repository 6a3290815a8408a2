"""What a coupled step and its exchange cost: beside the kernels, by the way of the messages, and between two machines.

    python scripts/bench_exchange.py [SCENE] [--set KEY=VALUE] [--step] [--links] [--lan] [--steps N] [--repeats R] [--beside B]
                                     [--json FILE] [--page FILE]

--step   Runs SCENE (default configs/paper_slope.toml) to the end of its couple stage in two processes, and goes on for R pairs of
         stages of N and 5 N coupled steps at rest without frames: a coupled step is the difference of a pair over 4 N, without
         what a stage costs once (its last frame and checkpoint, the start of a process). It then loads both checkpoints and times

             kernels of a side    its steps in one compiled call, nothing exchanged
             a side alone         its steps one by one, with the Python between its kernels
             wire                 the same bytes there and back between two compiled loops, nothing computed
             link                 the same messages over ZeroMQ, as in `colluvium run`
             encrypted link       the same through gate and passage with CURVE, as between two machines, here on one

         The bound of a coupled step is the kernels of the slower side and the wire. Then such pairs with the scene's frames and
         without, in turns, all from the end of the couple stage: by what share recording stalls the loop.
--links  Times the exchange alone for rims of 50, 100, 500 and 5,000 nodes by every way, the ways in turns, beside a compiled loop
         on a plain TCP connection with the same frames and checks; counts system calls and bytes where `strace` is installed.
--lan    Runs such pairs with both servers in network namespaces whose line delays each way by 0.1, 0.5 and 2 ms (scripts/lan.py),
         and compares with the slower side and the measured round trip. It needs root and /dev/net/tun.

Without --step, --links and --lan, all of it (five minutes on two cores). `--beside B`: with B busy processes. A triad in the same
run says what the memory of this machine gave. Medians; seconds of wall time. --page FILE puts the tables into the sections
`exchange`, `links` and `lan` of a page.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path
from statistics import median

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import lan
from bench import coupled_step, lan_steps, links
from bench.timing_rows import row, triad, write
from pages import markdown, plain, write_section

from coupler_protocol.scene.reader import read_scene
from coupler_protocol.wire.lanes import EARLIEST

PARTS = ("step", "links", "lan")


def us(seconds):
    """Seconds as microseconds in a table."""
    return "-" if seconds is None else f"{1e6 * seconds:.1f}" if seconds < 1e-4 else f"{1e6 * seconds:,.0f}"


STEP_COLUMNS = {
    "name": "", "value": ("[us]", us), "spread": ("spread [%]", lambda x: f"{100 * x:.1f}"), "note": "",
}  # fmt: skip
LAN_COLUMNS = {
    "delay": "delay, one way [ms]", "way": "messages", "value": ("coupled step [us]", us), "round_trip": ("round trip [us]", us),
    "round_trip_encrypted": ("over the link [us]", us), "bound": ("bound [us]", us), "over": ("step over bound", "{:.2f}".format),
    "exchanges": "exchanges a step",
}  # fmt: skip


class Step:
    """A scene at the end of its couple stage: its coupled step, and both sides on the same states."""

    def __init__(self, original, options, folder):
        self.original, self.options, self.folder, self.begun = original, options, folder, folder / "begun"
        steps, repeats = options.steps, options.repeats
        scene = coupled_step.with_measured_stages(original, steps, repeats, EARLIEST + 100)  # plain steps are compiled in it
        self.together = coupled_step.coupled(scene, self.begun)
        words = scene, self.begun, steps, repeats
        self.kernels = coupled_step.kernels_of_grid(*words), coupled_step.kernels_of_discs(*words)
        self.alone = coupled_step.continuum_alone(*words), coupled_step.discs_alone(*words)
        self.nodes = json.loads((self.begun / "run.json").read_text(encoding="utf-8"))["windows"][0]["control_nodes"]
        self.size = {"rim_nodes": self.nodes}

    @property
    def sides(self):
        """Medians of both sides, by the form of their steps."""
        return {"kernels": [*map(median, self.kernels)], "one by one": [*map(median, self.alone)]}

    def rows(self, companion):
        """Rows of --step."""
        repeats, size = self.options.repeats, self.size
        turns = coupled_step.in_turns(self.original, self.options.steps, repeats, self.begun, self.folder)
        ways = links.seconds_of_ways(("lane", "link", "encrypted link"), [self.nodes], repeats)
        wire, link, encrypted = (seconds for seconds, _ in ways.values())
        rows = [
            row("coupled step", size, self.together, "s/step", companion, "two processes, nothing recorded"),
            row("kernels of the grid", size, self.kernels[0], "s/step", companion),
            row("kernels of the discs", size, self.kernels[1], "s/step", companion),
            row("wire", size, wire, "s", companion, "round trip over a lane"),
            row("grid alone, one by one", size, self.alone[0], "s/step", companion),
            row("discs alone, one by one", size, self.alone[1], "s/step", companion),
            row("link", size, link, "s", companion, "round trip over ZeroMQ"),
            row("encrypted link", size, encrypted, "s", companion, "the same through gate and passage with CURVE"),
        ]
        bound = max(rows[1]["value"], rows[2]["value"]) + rows[3]["value"]
        rows.append(row("bound: slower kernels + wire", size, [bound], "s/step", companion))
        rows += [
            row(f"coupled step, {words}", size, seconds, "s/step", companion, "in turns") for words, seconds in turns.items()
        ]
        ratios = [with_ / without for without, with_ in zip(*turns.values(), strict=True)]
        note = f"a frame every {self.original.record.every} steps"
        rows.append(row("coupled step with frames over without", size, ratios, "-", companion, note))
        return rows


def step_tables(rows):
    """Columns, rows and last line of the table of --step."""
    by_name = {r["name"]: r for r in rows}
    bound, stalls = by_name["bound: slower kernels + wire"]["value"], by_name["coupled step with frames over without"]
    last = (
        f"coupled / bound {by_name['coupled step']['value'] / bound:.2f}; "
        f"triad {rows[0]['companion']['triad_GB_per_s']:.1f} GB/s; recording stalls the loop by "
        f"{100 * (stalls['value'] - 1.0):.1f} % (median of {stalls['repeats']} turns; {stalls['note']})"
    )
    return [(STEP_COLUMNS, [r for r in rows if r["unit"] != "-"])], last


def link_tables(rows):
    """Tables of --links: seconds by way and size; what an exchange needs besides."""
    sizes, ways = list(dict.fromkeys(r["size"]["rim_nodes"] for r in rows)), list(dict.fromkeys(r["name"] for r in rows))
    cells = {(r["name"], r["size"]["rim_nodes"]): r for r in rows}
    times = [
        {"way": links.WORDS[way]}
        | {n: f"{us(cells[way, n]['value'])} ({cells[way, n]['over_raw']:.1f})" for n in sizes}
        | {"sleeps": cells[way, sizes[0]]["sleeps"]}
        for way in ways
    ]
    columns = {
        "way": "exchange [us] (over the first row)",
        **{n: f"{n:,} nodes" for n in sizes},
        "sleeps": ("sleeps", "{:.1f}".format),
    }
    tables = [(columns, times)]
    counted = [way for way in ways if "bytes" in cells[way, sizes[0]]]
    if counted:
        few, many = sizes[0], sizes[-1]

        def needs(way, nodes):
            return f"{cells[way, nodes]['carrying_calls']:.0f} + {cells[way, nodes]['other_calls']:.0f}"

        lines = [
            {"way": links.WORDS[way], "few": needs(way, few), "many": needs(way, many)}
            | {n: f"{cells[way, n]['bytes']:,.0f}" for n in sizes}
            for way in counted
        ]
        lines.append({"way": "both frames", **{n: f"{links.frame_bytes(n):,}" for n in sizes}})
        columns = {
            "way": "calls that carry bytes + others", "few": f"{few:,} nodes", "many": f"{many:,} nodes",
            **{n: f"bytes, {n:,} nodes" for n in sizes},
        }  # fmt: skip
        tables.append((columns, lines))
    last = f"the encrypted link takes {_times(cells, sizes, 'link')} times the link of `colluvium run`, and "
    last += f"{_times(cells, sizes, 'gated link')} times the link through a gate ({', '.join(f'{n:,}' for n in sizes)} nodes)"
    return tables, last + ("" if counted else "; strace is not installed: system calls and bytes were not counted")


def _times(cells, sizes, way):
    """How much longer an exchange over the encrypted link takes than by a way, for all sizes."""
    return ", ".join(f"{cells['encrypted link', n]['value'] / cells[way, n]['value']:.1f}" for n in sizes)


def lan_tables(rows):
    """Table of --lan."""
    lines = [
        {**r, "delay": r["size"]["delay_ms"], "way": r["name"].partition(", ")[2], "over": r["value"] / r["bound"]}
        | {
            "exchanges": 1.0
            if r["exchange_every"] == 1
            else f"1/{r['exchange_every']}" + (", fell back" if r.get("fell_back") else "")
        }
        for r in rows
    ]
    return [(LAN_COLUMNS, lines)], ""


TABLES = {"step": step_tables, "links": link_tables, "lan": lan_tables}
SECTIONS = {"step": "exchange", "links": "links", "lan": "lan"}


def report(part, rows, page):
    """Prints the tables of a part, and puts them into its section of a page."""
    tables, last = TABLES[part](rows)
    print("\n\n".join(plain(lines, columns) for columns, lines in tables), last, sep="\n", end="\n\n", flush=True)
    if page:
        texts = [markdown(lines, columns) for columns, lines in tables] + ([f"{last[0].upper()}{last[1:]}."] if last else [])
        write_section(page, SECTIONS[part], "\n\n".join(texts))


@contextmanager
def busy_processes(count):
    """While this lasts, `count` processes keep a processor busy each."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def main():
    """Entry point; returns the exit code."""
    options = arguments()
    parts = [part for part in PARTS if getattr(options, part)] or PARTS
    original, rows = read_scene(options.scene, options.set), []
    with tempfile.TemporaryDirectory() as name, busy_processes(options.beside):
        companion = {"triad_GB_per_s": median(triad(options.repeats))}
        step = Step(original, options, Path(name)) if {"step", "lan"} & {*parts} else None
        for part in parts:
            if part == "lan" and (lacking := lan.missing()):
                print(f"no rows of a LAN: {lacking}")
                continue
            if part == "step":
                found = step.rows(companion)
            elif part == "links":
                found = links.rows_of_ways(options.repeats, companion=companion)
            else:
                found = lan_steps.rows_of_lan(
                    original, step.begun, Path(name), step.nodes, step.sides, options.repeats, companion
                )
            report(part, found, options.page)
            rows += found
    if options.json:
        write(rows, options.json)
    return 0


def arguments():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default=Path(__file__).parent.parent / "configs" / "paper_slope.toml")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="overrides a key of the scene")
    parser.add_argument("--step", action="store_true", help="the coupled step and its parts")
    parser.add_argument("--links", action="store_true", help="the exchange by every way")
    parser.add_argument("--lan", action="store_true", help="the coupled step between two machines")
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", metavar="FILE")
    parser.add_argument("--page", metavar="FILE", help="page whose sections `exchange`, `links` and `lan` get the tables")
    parser.add_argument("--beside", type=int, default=0, metavar="B", help="busy processes beside (default 0)")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
