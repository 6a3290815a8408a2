"""Rules and doubts about motions of sides that come from files (fdm_server/ground/shaking.py).

A wave needs PER_WAVE zones in its length (Kuhlemeyer, R. L. & Lysmer, J. (1973), J. Soil Mech. Found. Div. ASCE 99, 421-427):
zones of size h carry frequencies up to f = c / (PER_WAVE h).
"""

import numpy as np

from coupler_protocol.files import motion_csv
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.named_files import absent, boundaries_of
from coupler_protocol.scene.stage_kinds import of

PER_WAVE = 10.0  # zones in the length of a wave
BEYOND = 0.01  # share of v^2 at higher frequencies, above: doubted
DRIFT = 0.05  # final displacement over the largest one, above: doubted
ABRUPT = 0.05  # first or last velocity over the largest one, above: doubted


def motions_can_be_read(scene):
    """Files of motions exist, are valid in every line, and have the columns that are used."""
    for path, table in _tables(scene):
        at = (*path, "file")
        try:
            found = motion_csv.read(table.file, "shaking.file")
        except SceneError as error:
            for problem in error.problems:
                line = "" if problem.line is None else f"{table.file}:{problem.line}: "
                yield at, line + problem.reason, problem.remedy
            continue
        for column in table.factors:
            if column not in found.velocity:
                remedy = f"add the column, or remove {column}: the file has {', '.join(found.velocity)}"
                yield at, f"{table.file} has no column {column!r}", remedy


def doubts_of_motions(scene, grid):
    """Yields doubts about motions that drift, begin or end abruptly, outlast their stage, or are too fast for the zones."""
    for path, table in _tables(scene):
        if absent(scene, (*path, "file")):
            continue
        found = motion_csv.read(table.file, "shaking.file")
        until = _end_of_its_stage(scene, path)
        if until is not None and until < found.time[-1] * (1.0 - 1e-9):
            what = f"{table.file} lasts {found.time[-1]:.4g} s, and its stage ends after {until:.4g} s"
            yield (*path, "file"), f"{what}, in the middle of the motion", "use until.time of at least the length of the file"
        for column, factor in table.factors.items():
            if factor and np.any(found.velocity[column]):
                yield from _doubts_of_column(scene, grid, (*path, "file"), table.file, found, column)


def _tables(scene):
    """(path, table) of all motions of a scene."""
    return [((*path, "shaking"), b.shaking) for path, b in boundaries_of(scene) if b.shaking is not None]


def _end_of_its_stage(scene, path):
    """Seconds [s] of the stage in which the motion at `path` begins, or None."""
    first = next((i for i, stage in enumerate(scene.stage) if of(stage).computes and not stage.discard), 0)
    stage = scene.stage[path[1] if path[0] == "stage" else first]
    return stage.until.time if stage.until is not None else None


def _doubts_of_column(scene, grid, at, file, found, column):
    v = found.velocity[column]
    ends = max(abs(v[0]), abs(v[-1])) / np.abs(v).max()
    if ends > ABRUPT:
        what = f"column {column} of {file} begins or ends with {ends:.0%} of its largest velocity: a blow"
        yield at, what, "let the motion begin and end at rest (taper both ends)"
    path = np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(found.time))
    if abs(path[-1]) > DRIFT * np.abs(path).max():
        what = (
            f"column {column} of {file} ends {path[-1]:.3g} m from where it began; at most it is {np.abs(path).max():.3g} m away"
        )
        yield at, f"{what}: the side drifts", "correct the baseline of the record, unless the displacement is intended"
    limit = _highest_frequency(scene, grid, column)
    beyond = _share_beyond(found, v, limit)
    if beyond > BEYOND:
        what = f"{beyond:.1%} of v^2 in column {column} of {file} is above {limit:.3g} Hz, the highest frequency of waves with "
        yield at, f"{what}{PER_WAVE:g} zones in their length", "use smaller zones, or filter the motion"


def _highest_frequency(scene, grid, column):
    """Highest frequency [Hz] that all zones carry: of shear waves for x, of P waves for y."""
    corners = grid.xy[grid.zones]
    side = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    speed = np.empty(len(scene.material))
    for i, material in enumerate(scene.material):
        modulus = material.elastic.shear if column == "x" else material.elastic.bulk + 4.0 * material.elastic.shear / 3.0
        speed[i] = np.sqrt(modulus / material.density)
    return float((speed[grid.material] / (PER_WAVE * side)).min())


def _share_beyond(found, v, limit):
    """Share of v^2 above a frequency [Hz], of the motion at even times."""
    count = max(round((found.time[-1] - found.time[0]) / np.diff(found.time).min()) + 1, 2)
    count = min(count, 1 << 20)
    time = np.linspace(found.time[0], found.time[-1], count)
    power = np.abs(np.fft.rfft(np.interp(time, found.time, v), 2 * count)) ** 2  # padded: the motion is not periodic
    frequency = np.fft.rfftfreq(2 * count, time[1] - time[0])
    return float(power[frequency > limit].sum() / power.sum())
