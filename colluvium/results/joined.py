"""The folders of two machines as one run: whether they belong together, and how far both sides came."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from colluvium.results.rank_file import RankFile
from colluvium.results.rank_parts import RankParts
from coupler_protocol.exits import EnvironmentFailed

Files = Mapping[int, RankFile | RankParts]


def check(folders: Sequence[Path], files: Sequence[Files]) -> None:
    """Raises EnvironmentFailed unless two folders are those of the two sides of one run. files: of each folder, by rank."""
    first, second = folders
    if first.resolve() == second.resolve():
        raise EnvironmentFailed(f"{first} and {second} are one folder: give the folder of either machine")
    for folder, found in zip(folders, files, strict=True):
        if not found:
            raise EnvironmentFailed(f"{folder} has no file NAME.rankN.vtkhdf: copy the --out of the other machine's server there")
    own, other = (_identity(found) for found in files)
    if own != other:
        what = "runs" if own[0] != other[0] else "scenes"
        numbers = " and ".join(identity[0] or "without a number" for identity in (own, other))
        raise EnvironmentFailed(
            f"{first} and {second} are of different {what} ({numbers}): give the two folders of one run; its number is in "
            "run.json, dem.rank1.json and in every line of the logs"
        )
    if not set(files[1]) - set(files[0]):
        raise EnvironmentFailed(
            f"{second} has no rank that {first} lacks ({_ranks(files[1])}): give the folder of the grid and that of the discs"
        )


def _identity(files: Files) -> tuple[str, str]:
    """Number of the run and hash of the scene of the files of a folder; the newest rank counts, which was written last."""
    newest = max(files.values(), key=lambda file: file.written)
    return newest.run, newest.scene


def _ranks(files: Files) -> str:
    return ", ".join(f"rank {rank}" for rank in sorted(files))


def ends(files: Files) -> dict[int, int]:
    """Step of the last frame of each rank that has frames."""
    return {rank: file.frames[-1].step for rank, file in files.items() if file.frames}


def cut(files: Files) -> tuple[int | None, str]:
    """Last step that all ranks have, and in words which rank ends before the others; (None, "") if they end together."""
    last = ends(files)
    if not last or min(last.values()) == max(last.values()):
        return None, ""
    step = min(last.values())
    behind = [rank for rank, end in last.items() if end == step]
    words = ", ".join(f"rank {rank} ends at step {end:,}" for rank, end in sorted(last.items()))
    return step, f"{words}: the files of {' and '.join(f'rank {rank}' for rank in behind)} are older, or that side was cut short"
