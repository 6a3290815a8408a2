"""Who may import whom: a room imports rooms further right in the table, never further left, and never its neighbours.

A name comes from the module that defines it, or from one that lists it in `__all__`.
"""

import ast
from functools import cache

import pytest

from tests.house.tree import PACKAGES, ROOT, files

# > stands between levels, a comma between rooms of one level. Rooms in brackets are kept ready: they may be missing.
# The three modules in front of colluvium's row are documented doors: users import them, no room does.
ORDER = "colluvium > fdm_server, dem_server > coupler_protocol"
ROOMS = {
    "coupler_protocol": "process > files, wire > scene, interface, measures > exits > compiled, criteria, geometry, problems",
    "fdm_server": "__main__ > procedure > run > fos, coupling > checks, observe > ground, (structures) > model > mesh > step"
    " > effects",
    "dem_server": "__main__ > procedure > run, packing, insitu > coupling > stones, observe > step > model, pairs > effects",
    "colluvium": "stones, timeline, window_fields > cli > ensemble > report, status, doctor > html > calibration, safety"
    " > closing, lab, accuracy > forecast > figures, api > results, running, examples",
}
BARRED = {  # room: what it must not import although the table lets it
    "colluvium/results": ("fdm_server", "dem_server"),
    "colluvium/figures": ("fdm_server", "dem_server"),
    "fdm_server/effects": ("coupler_protocol.compiled",),
    "dem_server/effects": ("coupler_protocol.compiled",),
}
COMPILER = ("numba", "llvmlite")  # imported in coupler_protocol/compiled only


def levels(row):
    """Level of each room of a row, 0 at the left."""
    return {room.strip(" ()"): i for i, level in enumerate(row.split(">")) for room in level.split(",")}


def imports(path):
    """Line and dotted name of every import of a file, those inside functions too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: a relative import"
            yield from ((node.lineno, f"{node.module}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)


def fault(package, room, name):
    """What is wrong with the import of `name` in a room of a package, or None."""
    target, _, rest = name.partition(".")
    if target in COMPILER:
        return None if (package, room) == ("coupler_protocol", "compiled") else "only coupler_protocol/compiled compiles"
    if any(f"{name}.".startswith(f"{barred}.") for barred in BARRED.get(f"{package}/{room}", ())):
        return f"{package}/{room} does without {target}"
    if target in ROOMS and target != package:
        return None if levels(ORDER)[package] < levels(ORDER)[target] else f"{package} may not import {target}"
    if target != package:
        return None
    level, there = levels(ROOMS[package]), rest.partition(".")[0]
    if room in ("__init__", there):
        return None
    if there not in level:
        return "not a room of the table"
    return None if level[room] < level[there] else f"{room} may not import {there}"


def violations(root):
    """Every import that the table forbids, and every file that stands in no room of it."""
    for package, row in ROOMS.items():
        for path in (path for path in files([package], root) if path.suffix == ".py"):
            where = path.relative_to(root)
            room = where.parts[1].removesuffix(".py")
            if room != "__init__" and room not in levels(row):
                yield f"{where}: in no room of the table"
                continue
            faults = ((line, name, fault(package, room, name)) for line, name in imports(path))
            yield from (f"{where}:{line}: {name}: {why}" for line, name, why in faults if why)


def test_every_import_is_one_of_the_table():
    found = list(violations(ROOT))
    assert not found, "\n".join(found)


@pytest.mark.parametrize("package", ROOMS)
def test_every_room_of_the_table_is_there(package):
    wanted = {room.strip() for level in ROOMS[package].split(">") for room in level.split(",")}
    there = {path.relative_to(ROOT).parts[1].removesuffix(".py") for path in files([package])}
    assert {room for room in wanted if not room.startswith("(")} <= there


@pytest.mark.parametrize(
    ("place", "line", "why"),
    [
        ("fdm_server/step/planted.py", "from fdm_server.model import Model", "step may not import model"),
        ("dem_server/insitu/planted.py", "def f():\n    from dem_server import run", "insitu may not import run"),
        ("dem_server/run.py", "import fdm_server.run", "dem_server may not import fdm_server"),
        ("fdm_server/run.py", "from dem_server.pairs import contacts", "fdm_server may not import dem_server"),
        ("coupler_protocol/process/planted.py", "import colluvium.api", "coupler_protocol may not import colluvium"),
        ("coupler_protocol/wire/planted.py", "from fdm_server.model import Model", "coupler_protocol may not import fdm_server"),
        ("colluvium/figures/planted.py", "import numba", "only coupler_protocol/compiled compiles"),
        ("dem_server/step/planted.py", "from numba import njit", "only coupler_protocol/compiled compiles"),
        ("colluvium/results/planted.py", "from dem_server import pairs", "colluvium/results does without dem_server"),
        ("dem_server/effects/planted.py", "from coupler_protocol.compiled.jit import jit", "does without coupler_protocol"),
        ("colluvium/report.py", "from colluvium.stones import outlines", "report may not import stones"),
        ("colluvium/report.py", "from colluvium.nowhere import f", "not a room of the table"),
        ("fdm_server/rates.py", "", "in no room of the table"),
        ("colluvium/lounge/__init__.py", "", "in no room of the table"),
    ],
)
def test_a_planted_import_is_found(tmp_path, place, line, why):
    path = tmp_path / place
    path.parent.mkdir(parents=True)
    path.write_text(line + "\n", encoding="utf-8")
    found = list(violations(tmp_path))
    assert len(found) == 1
    assert why in found[0]


@cache
def offered(path):
    """Names that a module defines, or that its `__all__` lists."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.add(node.id)
        elif isinstance(node, ast.Assign) and any(isinstance(t, ast.Name) and t.id == "__all__" for t in node.targets):
            found |= set(ast.literal_eval(node.value))
    return found


def passed_on(root):
    """Every import of a name of ours from a module that has it from somewhere else itself."""
    folders = [folder for folder in (*PACKAGES, "scripts", "tests") if (root / folder).is_dir()]
    for path in (path for path in files(folders, root) if path.suffix == ".py"):
        for line, name in imports(path):
            module, _, last = name.rpartition(".")
            place = root.joinpath(*module.split("."))
            source = next((p for p in (place.with_suffix(".py"), place / "__init__.py") if p.is_file()), None)
            submodule = (place / last).is_dir() or (place / f"{last}.py").is_file()
            if module.partition(".")[0] in PACKAGES and source and not submodule and last not in (*offered(source), "*"):
                yield f"{path.relative_to(root)}:{line}: {module} does not define {last}: import it from where it is defined"


def test_a_name_comes_from_where_it_is_defined():
    found = list(passed_on(ROOT))
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("from coupler_protocol.geometry import area", 0),
        ("from coupler_protocol import geometry, ring", 0),
        ("def f():\n    from coupler_protocol.ring import area", 1),
        ("from coupler_protocol.ring import Ring, Moments", 0),
        ("import coupler_protocol.ring", 0),
    ],
)
def test_a_planted_name_from_elsewhere_is_found(tmp_path, line, found):
    package = tmp_path / "coupler_protocol"
    (tmp_path / "scripts").mkdir()
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "geometry.py").write_text("class Moments: ...\ndef area(): ...\n", encoding="utf-8")
    text = "from coupler_protocol.geometry import Moments, area\n__all__ = ['Moments']\nRing = area\n"
    (package / "ring.py").write_text(text, encoding="utf-8")
    (tmp_path / "scripts" / "planted.py").write_text(line + "\n", encoding="utf-8")
    assert len(list(passed_on(tmp_path))) == found
