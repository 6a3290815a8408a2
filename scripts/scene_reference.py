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

from coupler_protocol.scene.scene import scene_class

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "scene.md"
HEAD = """# Scenes

Made by `scripts/scene_reference.py` from the declarations that also check scenes; edit those, not this page.

A scene is a TOML file. SI units, angles in degrees, tension positive in every stress. A table marked *effect* switches a law on:
without the table there is no such code, memory or output. `--set KEY=VALUE` overrides a key, list items by number:
`--set material.0.density=2000`.
`colluvium check SCENE` names every mistake with its line, or says what the scene will compute.
`colluvium run SCENE --out DIR` computes it; a scene without `[[window]]` and `[discs]` is one of the continuum alone.

Stages follow each other and keep what they find: stresses, displacements, gravity, boundaries. There is no gravity before a stage
sets `gravity`. A stage ends at the first of its `until` conditions, but at a ratio only after its ramps. Velocities are metres a
step, for static stages advance by steps; in stages with `time = "real"` they are metres a second. Static stages need `[damping]`
to come to rest. Stiffness is given by bulk and shear modulus: K = E / (3 (1 - 2 nu)), G = E / (2 (1 + nu)).

What came out is in DIR: `run.json` has the stages with the reactions of all held sides at their ends; `colluvium.open_run` reads
frames and histories (docs/output.md):

```python
from colluvium import open_run

with open_run("DIR") as run:
    steps, force = run.history("reaction_y:footing")   # [N] per metre, on the ground: negative where it is pressed down
    xy, stress = run.zones(-1).xy, run.zones(-1).stress   # last frame: middles (Z, 2), xx yy zz xy (Z, 4)
```
"""
EXAMPLES = (
    (
        "A slope",
        "layered_slope.toml",
        "Zones follow the profile at any angle; columns and rows of zones are counted from the lower left corner, as if the net "
        "went on above the ground. Below the third row under the surface zones are rectangles.",
    ),
    (
        "A window of any shape",
        "quick_notch.toml",
        "A polygon takes the zones whose centres it holds. Draw its corners where gridpoints are: the rim follows the sides "
        "of zones. `colluvium check` says how large the window became.",
    ),
    (
        "A footing",
        "footing.toml",
        "Displacement-controlled: part of a side moves, its reaction is the load. Slow enough is when half the velocity gives "
        "the same load. Loading by `pressure` finds the capacity only as the load at which the stage does not come to rest.",
    ),
    (
        "A hole",
        "hole.toml",
        "The ground begins in its stress, what is inside the hole holds the wall, and is taken away over some steps. Yielding "
        "rock remembers how it was unloaded: take `over` long enough that twice as long gives the same wall displacement. For a "
        "stress p in all directions use `xx = -p`, `yy = -p` in the four places, or `pressure = p` on inner and outer.",
    ),
    (
        "A biaxial test on discs alone",
        "quick_biaxial.toml",
        "No grid: discs, walls with servos, and a wall that moves otherwise from a stage on. More about packings, sizes, walls "
        "and discs from files: [packings.md](packings.md).",
    ),
    (
        "Stones from a photograph",
        "mapped_stones.toml",
        "Trace the stones as polygons, in pixels or metres: GeoJSON from any drawing or mapping program, or a CSV file with one "
        "corner a line. `colluvium check` names outlines that cross or overlap. The same keys serve windows in a grid, "
        "in whose coordinates `origin` is then given. For random stones of traced shapes: `shapes = ..` with content and size "
        "in place of `file`; for a preferred direction `azimuth = { mean = 30.0, spread = 15.0 }`.",
    ),
    (
        "A slide in softening soil",
        "softening_slide.toml",
        "Softening, a stage in real time with its own damping, and the ledger of energies. What softens fails in bands one "
        "zone wide: compare zone sizes. Give `strain` twice as large for zones half as large to keep the energy a band takes.",
    ),
)


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
    choices = list(choices_in(field.annotation))
    return ", ".join(parts + ([" \\| ".join(choices)] if choices else []))


def choices_in(annotation):
    """The words that an annotation allows, also inside unions."""
    for part in typing.get_args(annotation):
        if typing.get_origin(annotation) is typing.Literal and isinstance(part, str):
            yield part
        elif not (isinstance(part, type) and issubclass(part, BaseModel)):
            yield from choices_in(part)


def examples():
    """Shipped scenes in full, with a word about each."""
    lines = ["## Worked examples", ""]
    for title, name, words in EXAMPLES:
        text = (ROOT / "configs" / name).read_text(encoding="utf-8").rstrip()
        lines += [f"### {title}: `configs/{name}`", "", words, "", "```toml", text, "```", ""]
    return lines


def page():
    """The whole page."""
    from coupler_protocol.scene.declare import Effect

    lines, described = [HEAD, *examples()], {}
    for path, model, many in tables(scene_class(), ""):
        mark = f"[[{path}]]" if many else f"[{path}]" if path else "Top level"
        effect = " (effect)" if issubclass(model, Effect) else ""
        lines += [f"## `{mark}`{effect}", ""]
        if model in described:
            lines += [f"The same keys as `{described[model]}`.", ""]
            continue
        described[model] = mark
        lines += [" ".join((model.__doc__ or "").split()), ""]
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
