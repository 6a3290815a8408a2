"""Packings of laboratory samples over seeds: how many growths of the radii they need, and which seeds miss their stress.

    python scripts/studies/sample_packings.py SCENE [--sample soil|clump|cluster] [--pressure P] [--seeds FIRST LAST]
        [--set KEY=VALUE ..]

Packs the samples of a biaxial test of `colluvium lab` at a confining stress P [Pa], one a seed, and nothing else. A packing that
does not rest at its stress after the largest number of growths (dem_server/packing/growth.py) fails its test.
"""

import argparse
import sys
from pathlib import Path

from colluvium.lab.trials import samples_of, trial
from coupler_protocol.scene.reader import build_scene, read_scene
from dem_server.packing import alone_window, growth


def growths(scene, sample, pressure, seed):
    """Number of growths until the packing of a sample rests at its stress; None if it does not."""
    tables = trial("biaxial", scene, sample, pressure, seed).tables
    only_fill = build_scene(tables | {"stage": tables["stage"][:1]})
    looks = []
    try:
        alone_window.fill(only_fill, lambda text, share: looks.append(text))
    except ArithmeticError as error:
        print(f"seed {seed}: {error}", file=sys.stderr)
        return None
    return sum(text.startswith("mean stress") for text in looks)


def main(argv=None):
    """Pack all samples and say how they did; returns the exit code, 1 if one missed its stress."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("--sample", choices=("soil", "clump", "cluster"), help="default: the last one that the scene tests")
    parser.add_argument("--pressure", type=float, default=1e5, metavar="P", help="confining stress [Pa] (default 1e5)")
    parser.add_argument("--seeds", type=int, nargs=2, default=(1, 40), metavar=("FIRST", "LAST"))
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    options = parser.parse_args(argv)
    scene = read_scene(options.scene, options.set)
    sample = options.sample or samples_of(scene)[-1]
    seeds = range(options.seeds[0], options.seeds[1] + 1)
    found = {seed: growths(scene, sample, options.pressure, seed) for seed in seeds}
    reached = sorted(number for number in found.values() if number is not None)
    missed = [seed for seed, number in found.items() if number is None]
    print(f"{sample}: {len(missed)} of {len(found)} packings miss their stress" + (f": seeds {missed}" if missed else ""))
    if reached:
        middle = reached[len(reached) // 2]
        print(f"growths: {reached[0]} to {reached[-1]}, median {middle}, of at most {growth.GROWTHS}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
