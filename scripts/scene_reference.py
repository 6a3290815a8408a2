"""Write docs/scene.md from the declarations of the scene's tables: every key with unit, default, bounds and meaning.

    python scripts/scene_reference.py [--check]

--check: write nothing, exit 1 if the page is not what the declarations say.
"""

import argparse
import sys
import typing
from pathlib import Path

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from coupler_protocol.scene import scene_class

PAGE = Path(__file__).resolve().parent.parent / "docs" / "scene.md"
HEAD = """# Scenes

Made by `scripts/scene_reference.py` from the declarations that also check scenes; edit those, not this page.

A scene is a TOML file. SI units, angles in degrees, tension positive in every stress. A table marked *effect* switches a law on:
without the table there is no such code, memory or output. `--set KEY=VALUE` overrides a key, list items by number:
`--set material.0.density=2000`.
`colluvium check SCENE` names every mistake with its line, or says what the scene will compute.
"""


def tables(model, path, many=False):
    """(path, class, whether it is a list) of a table and of all below it, in order."""
    yield path, model, many
    for name, field in model.model_fields.items():
        inner, is_list = table_in(field.annotation)
        if inner:
            yield from tables(inner, f"{path}.{name}" if path else name, is_list)


def table_in(annotation, in_list=False):
    """The table class inside an annotation, and whether it stands in a list."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation, in_list
    for part in typing.get_args(annotation):
        found, is_list = table_in(part, in_list or typing.get_origin(annotation) is list)
        if found:
            return found, is_list
    return None, False


def default_of(field):
    """The default as it would be written, or "required"."""
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=True)
    if value is None or value is PydanticUndefined or isinstance(value, BaseModel):
        return "none" if not isinstance(value, BaseModel) else "see below"
    return str(value).lower() if isinstance(value, bool) else str(value)


def bounds_of(field):
    """Bounds and choices in words."""
    signs = {"ge": ">=", "gt": ">", "le": "<=", "lt": "<", "min_length": "at least", "max_length": "at most"}
    limits = [(sign, getattr(m, key, None)) for m in field.metadata for key, sign in signs.items()]
    parts = [f"{sign} {value:g}" for sign, value in limits if value is not None]
    kinds = (field.annotation, *typing.get_args(field.annotation))  # Literal["a", "b"], or that | None
    choices = [c for kind in kinds for c in typing.get_args(kind) if isinstance(c, str)]
    return ", ".join(parts + ([" \\| ".join(choices)] if choices else []))


def page():
    """The whole page."""
    from coupler_protocol.declare import Effect

    lines = [HEAD]
    for path, model, many in tables(scene_class(), ""):
        mark = f"[[{path}]]" if many else f"[{path}]" if path else "Top level"
        effect = " (effect)" if issubclass(model, Effect) else ""
        lines += [f"## `{mark}`{effect}", "", " ".join((model.__doc__ or "").split()), ""]
        lines += ["| key | unit | default | bounds | meaning |", "|---|---|---|---|---|"]
        for name, field in model.model_fields.items():
            unit = (field.json_schema_extra or {}).get("unit", "")
            lines.append(f"| `{name}` | {unit} | {default_of(field)} | {bounds_of(field)} | {field.description or ''} |")
        lines.append("")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true")
    if parser.parse_args().check:
        return int(PAGE.read_text(encoding="utf-8") != page())
    PAGE.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
