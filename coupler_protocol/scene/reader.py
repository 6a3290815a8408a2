"""Reader of TOML files: a scene, or the list of all its problems."""

import codecs
import difflib
import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from coupler_protocol.problems import KeyPath, Problem, SceneError, dotted, reason_and_remedy
from coupler_protocol.scene.changes import CANNOT, CHANGING, FOR_ALL_STAGES
from coupler_protocol.scene.named_files import absent, located
from coupler_protocol.scene.rules.between_tables import broken_rules
from coupler_protocol.scene.scene import scene_class
from coupler_protocol.scene.toml_lines import line_of, locate

Lines = Mapping[KeyPath, int]  # line of each key

FROM_SET = 0  # in place of a line, for values from the command line
ALIKE = 0.7  # similarity of a mistyped key and the one that was probably meant
SYMBOLS = {
    "c": "cohesion", "phi": "friction", "psi": "dilation", "e": "young", "nu": "poisson", "k": "bulk", "g": "shear",
    "rho": "density", "gamma": "density", "unit_weight": "density", "kn": "normal", "ks": "shear", "mu": "coefficient",
}  # fmt: skip
DRY = "there is no pore water: the ground is dry, or computed in total stresses"
NOT_COMPUTED = dict.fromkeys(("water", "groundwater", "pore_pressure", "phreatic", "water_table"), DRY) | dict.fromkeys(
    ("anchor", "beam", "bolt", "cable", "geogrid", "liner", "pile", "structure"), "there are no structural elements"
)  # tables of other programs


def read_scene(path: str | Path, overrides: Sequence[str] = (), needs_files: bool = True) -> Any:
    """Reads the scene at `path`, TOML or the resolved scene.json of a run; `overrides` are KEY=VALUE texts ("seed=2").

    needs_files: whether files that the scene names must be on this machine; those that are there are checked in any case.
    Raises SceneError with all problems: file, line, key, reason, remedy. Raises OSError if the file exists but cannot be read.
    """
    data, lines = read_data(path)
    override(data, overrides, lines)
    return build_scene(data, str(path), lines, Path(path).parent, needs_files)


def read_data(path: str | Path) -> tuple[dict[str, Any], dict[KeyPath, int]]:
    """Plain data of the file of a scene, not checked, and the lines of its keys; raises as `read_scene` does."""
    path = Path(path)
    try:
        content = path.read_bytes()
        text = content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except FileNotFoundError:
        near = sorted(p.name for p in path.parent.glob("*.toml")) if path.parent.is_dir() else []
        remedy = f"there: {', '.join(near)}" if near else "the shipped scenes are in configs/"
        raise SceneError([Problem(str(path), None, "", "there is no such file", remedy)]) from None
    except UnicodeDecodeError as error:
        raise SceneError([_not_utf_8(path, content, error)]) from None
    return _parsed(path, text)


def _not_utf_8(path: Path, content: bytes, error: UnicodeDecodeError) -> Problem:
    """Problem of a file in another encoding, named where the file begins with its mark."""
    marks = {"UTF-32": (codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE), "UTF-16": (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)}
    other = next((name for name, begins in marks.items() if content.startswith(begins)), "")
    what = f"a text in {other}" if other else f"not a text in UTF-8: {error.reason} at byte {error.start}"
    return Problem(str(path), None, "", what, "save it as UTF-8" if other else "is it a TOML file? Save it as UTF-8")


def _parsed(path: Path, text: str) -> tuple[dict[str, Any], dict[tuple[Any, ...], int]]:
    """Plain data of a TOML or JSON text, and the lines of its keys; raises SceneError."""
    is_json = path.suffix.lower() == ".json"
    try:
        data = json.loads(text, object_pairs_hook=_each_key_once) if is_json else tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError([_syntax_problem(path, error)]) from None
    except json.JSONDecodeError as error:
        why = f"not valid JSON: {error.msg} (column {error.colno})"
        raise SceneError([Problem(str(path), error.lineno, "", why, "see https://json.org")]) from None
    except _TwiceError as error:
        raise SceneError([Problem(str(path), None, str(error), f"the key {str(error)!r} is there twice", "remove one")]) from None
    except ValueError as error:  # an integer of thousands of digits
        raise SceneError([Problem(str(path), None, "", f"a number cannot be read: {error}", "use fewer digits")]) from None
    except RecursionError:
        raise SceneError([Problem(str(path), None, "", "tables or lists are nested too deeply", "is it a scene?")]) from None
    if not isinstance(data, dict):
        raise SceneError([Problem(str(path), None, "", f"not a scene, but a {type(data).__name__}", "a scene is an object")])
    return data, {} if is_json else locate(text)


class _TwiceError(ValueError):
    """A key of a JSON object that is there twice."""


def _each_key_once(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    """The dictionary of a JSON object; raises _TwiceError where one of two values would be lost."""
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise _TwiceError(key)
        found[key] = value
    return found


def build_scene(
    data: Mapping[str, Any], file: str = "scene", lines: Lines | None = None, folder: str | Path = ".", needs_files: bool = True
) -> Any:
    """Makes a scene from plain data (nested dictionaries and lists), with paths from `folder` on; raises SceneError.

    needs_files: as of `read_scene`.
    """
    lines = lines or {}
    data, wrong = located(data, folder)
    if wrong:
        raise SceneError([Problem(*_place(file, lines, path), dotted(path), why, remedy) for path, why, remedy in wrong])
    try:
        scene = scene_class().model_validate(data)
    except ValidationError as error:
        raise SceneError([_problem(e, file, lines) for e in error.errors()]) from None
    found = [row for row in broken_rules(scene) if needs_files or not absent(scene, row[0])]
    broken = [Problem(*_place(file, lines, path), dotted(path), why, remedy) for path, why, remedy in found]
    if broken:
        raise SceneError(broken)
    return scene


def _place(file: str, lines: Lines, path: KeyPath) -> tuple[str, int | None]:
    """File and line of a key, or the other source of its value."""
    line = line_of(lines, path)
    return ("--set", None) if line == FROM_SET else (file, line)


def _syntax_problem(path: str | Path, error: tomllib.TOMLDecodeError) -> Problem:
    words = str(error)
    line = words.partition("(at line ")[2].partition(",")[0]
    return Problem(str(path), int(line) if line.isdigit() else None, "", f"not valid TOML: {words}", "see https://toml.io")


def _problem(error: Any, file: str, lines: Lines) -> Problem:
    """Problem of one of pydantic's errors, with our reason and remedy."""
    path, kind = tuple(error["loc"]), error["type"]
    reason, remedy = error["msg"], ""
    if kind == "refused":
        remedy = error["ctx"]["remedy"]
    elif kind == "extra_forbidden":
        key = str(path[-1])
        known = _keys_at(path[:-1])
        close = difflib.get_close_matches(key, known, n=1, cutoff=ALIKE)
        close = [SYMBOLS[key.lower()]] if SYMBOLS.get(key.lower()) in known else close
        reason = "unknown key"
        remedy = f'did you mean "{close[0]}"?' if close else f"known here: {', '.join(sorted(known))}"
        remedy = f"{NOT_COMPUTED[key]}; {remedy}" if key in NOT_COMPUTED and not close else remedy
        if path[0] == "stage" and path[2] in CHANGING and key in _keys_at(path[2:-1]):
            reason, remedy = "this does not change between stages", CANNOT.get(key, FOR_ALL_STAGES)
    elif kind == "missing":
        reason, remedy = "missing", _meaning(path)
    elif kind == "literal_error":
        expected = error["ctx"]["expected"]
        remedy = f"known: {expected}"
        close = difflib.get_close_matches(str(error["input"]), re.findall(r"'([^']*)'", expected), n=1)
        remedy = f'did you mean "{close[0]}"? {remedy}' if close else remedy
        reason = f"{error['input']!r} is not known here"
    else:
        reason = reason.removeprefix("Value error, ").removeprefix("Input ")
        if not isinstance(error["input"], dict | list):
            reason += f", not {error['input']!r}"
        remedy = _within_bounds(error, path) + _meaning(path)
        if kind == "value_error":
            reason, remedy = reason_and_remedy(reason, remedy)
    return Problem(*_place(file, lines, path), dotted(path), reason, remedy)


def _within_bounds(error: Mapping[str, Any], path: KeyPath) -> str:
    """What a number outside its bounds could be instead, in front of the meaning of its key; "" for other errors."""
    value, limits = error["input"], error.get("ctx") or {}
    low, high = limits.get("ge", limits.get("gt")), limits.get("le", limits.get("lt"))
    if isinstance(value, bool) or not isinstance(value, int | float):
        return ""
    if low is None and high is None:
        return ""
    declared = getattr(_field_at(path), "json_schema_extra", None) or {}
    remedy = f"{declared['remedy']}; " if "remedy" in declared else ""
    if low == 0 and value < 0:
        return f"did you mean {-value:g}? {remedy}"
    if remedy or "usual" in declared:
        return remedy or "usual are {:g} to {:g}; ".format(*declared["usual"])
    if low is not None:
        return f"use {'at least' if 'ge' in limits else 'more than'} {low:g}; "
    return "" if high is None else f"use {'at most' if 'le' in limits else 'less than'} {high:g}; "


def _field_at(path: KeyPath) -> FieldInfo | None:
    """The declared field of a key; None where there is none."""
    path = tuple(path)
    while path and isinstance(path[-1], int):
        path = path[:-1]
    model = _model_at(path[:-1]) if path else None
    return model.model_fields.get(path[-1]) if model else None


def _model_at(path: KeyPath) -> Any:
    """Table class that contains the last key of `path`, or None."""
    model = scene_class()
    for part in path:
        if isinstance(part, int):
            continue
        field = model.model_fields.get(part) if model else None
        model = _table_in(field.annotation) if field else None
    return model


def _table_in(annotation: Any) -> Any:
    """The table class inside list[...], Optional[...] or Annotated[...], or None."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((t for t in map(_table_in, get_args(annotation)) if t), None)


def _keys_at(path: KeyPath) -> list[str]:
    model = _model_at(path)
    return list(model.model_fields) if model else []


def _meaning(path: KeyPath) -> str:
    """Unit and meaning of a key, as declared."""
    field = _field_at(path)
    if field is None:
        return ""
    name = next(part for part in reversed(tuple(path)) if not isinstance(part, int))
    extra: Any = field.json_schema_extra or {}
    unit = extra.get("unit", "-")
    return f"{name} [{unit}]: {field.description}"


def override(data: dict[str, Any], texts: Sequence[str], lines: dict[KeyPath, int] | None = None) -> None:
    """Sets KEY=VALUE texts in the plain data of a scene, and notes them in the lines of its keys; raises SceneError."""
    lines = {} if lines is None else lines
    if problems := [problem for text in texts for problem in _override(data, text, lines)]:
        raise SceneError(problems)


def _override(data: dict[str, Any], text: str, lines: dict[KeyPath, int]) -> list[Problem]:
    """Sets one KEY=VALUE in `data`; items of a list have their number or their name as key. Returns problems."""
    key, equals, value = text.partition("=")
    path = tuple(int(p) if p.isdecimal() else p for p in key.strip().split("."))
    if not equals or not key.strip():
        return [Problem("--set", None, text, "not of the form KEY=VALUE", "for example --set record.every=100")]
    try:
        value = tomllib.loads(f"v = {value}")["v"]
    except tomllib.TOMLDecodeError:
        value = value.strip()
    place: Any = data
    way: list[Any] = []
    for part in path:
        way.append(_numbered(place, part))
        try:
            if len(way) == len(path):
                place[way[-1]] = value
            else:
                if isinstance(place, dict) and place.get(way[-1]) is None:  # missing, or null in a resolved scene
                    place[way[-1]] = {}
                place = place[way[-1]]
        except (IndexError, TypeError):
            return [Problem("--set", None, key, f"there is no {part!r} here", "items of a list go by name, or number from 0")]
    lines[tuple(way)] = FROM_SET
    return []


def _numbered(place: Any, part: str | int) -> Any:
    """Number of the item with the name `part` if `place` is a list with such an item; else `part`."""
    names = [item.get("name") if isinstance(item, dict) else None for item in place] if isinstance(place, list) else []
    return names.index(part) if part in names else part
