"""Every file and every dotted name that docs, docstrings and comments name exists."""

import io
import pkgutil
import re
import tokenize
from pathlib import Path

import pytest

from tests.house.tree import PACKAGES, ROOT, files

FILE = re.compile(r"(?<![\w./*{}<>-])((?:[\w.-]+/)*[\w-]+\.(?:py|md|toml|geojson))\b(?![\w/])")
DOTTED = re.compile(rf"(?<![\w./-])((?:{'|'.join(PACKAGES)})(?:\.[A-Za-z_]\w*)+(?::\w+)?)")
PAGES = (".md", ".toml", ".html", ".js", ".css")
ELSEWHERE = ("CHANGELOG.md", "docs/design/0008-", "tests/house/")  # they tell of earlier trees, or plant names to be found
OF_A_USER = {
    "scene.toml",
    "follow.py",
    "discs.toml",
    "DIR/hexagonal_slope.toml",
    "runs/hexagonal/hexagonal_slope.toml",
}  # what a run writes, docs/plugins.md lets the reader write, a calibration writes, scripts/hexagonal_window.py writes
GROUPS = {"colluvium.effects", "colluvium.rules", "colluvium.doubts"}  # of entry points


def words(path):
    """Line, text, whether it is a string of code: all lines of a page, docstrings, comments and strings of a Python file."""
    text = path.read_text(encoding="utf-8")
    if path.suffix in PAGES:
        yield from ((number, line, False) for number, line in enumerate(text.splitlines(), 1))
        return
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string, False
        elif token.type == tokenize.STRING:
            docstring = token.string.startswith(('"""', 'r"""')) and token.line.strip().startswith(('"""', 'r"""'))
            yield token.start[0], token.string, not docstring


def missing_files(text, folder, there):
    """Names of source files in a text that no file of `there` (paths from the root) has; `folder`: where the text stands."""
    for name in FILE.findall(text):
        near = (folder / name).resolve()
        if name in OF_A_USER or near.is_file() or any(f"/{path}".endswith(f"/{name}") for path in there):
            continue
        yield name


def missing_names(text):
    """Dotted names of our packages in a text that resolve to nothing."""
    for name in DOTTED.findall(text):
        if name not in GROUPS and name.rpartition(".")[2] not in ("py", "md", "toml"):
            try:
                pkgutil.resolve_name(name)
            except (ImportError, AttributeError):
                yield name


def pages():
    """All files that say something to people about the tree as it is."""
    found = [*files(), *sorted(ROOT.glob("*.md")), ROOT / "pyproject.toml"]
    wanted = [path for path in found if path.suffix in (".py", *PAGES)]
    return [path for path in wanted if not path.relative_to(ROOT).as_posix().startswith(ELSEWHERE)]


def said():
    """Every word of the tree: path, line, text, whether in a string of code."""
    return [(path, *word) for path in pages() for word in words(path)]


def test_every_file_that_is_named_exists():
    there = [path.relative_to(ROOT).as_posix() for path in (*files(), *ROOT.glob("*.*"))]
    lost = [
        f"{path.relative_to(ROOT)}:{line}: {name}"
        for path, line, text, in_code in said()
        if not in_code
        for name in missing_files(text, path.parent, there)
    ]
    assert not lost, "\n".join(lost)


def test_every_dotted_name_resolves():
    lost = [f"{path.relative_to(ROOT)}:{line}: {name}" for path, line, text, _ in said() for name in missing_names(text)]
    assert not lost, "\n".join(lost)


@pytest.mark.parametrize(
    ("text", "lost"),
    [
        ("the loop (`fdm_server/run.py`), as run.py of the twin, test_names.py, ../../README.md and run.json", []),
        ("see `fdm_server/runs.py`, pace.py; not `fdm*.py` and not https://example.org/a.md", ["fdm_server/runs.py", "pace.py"]),
        ("[accuracy](../accuracies.md) and configs/quick_slope.toml", ["../accuracies.md"]),
    ],
)
def test_a_planted_file_name_is_found(text, lost):
    there = [path.relative_to(ROOT).as_posix() for path in files()]
    assert list(missing_files(text, Path(__file__).parent, there)) == lost


def test_a_planted_dotted_name_is_found():
    right = "colluvium.open_run(out), `coupler_protocol.exits`, colluvium.cli:main, the group colluvium.effects"
    assert list(missing_names(right)) == []
    text = f"{right}; colluvium.open_runs, fdm_server.net"
    assert list(missing_names(text)) == ["colluvium.open_runs", "fdm_server.net"]
