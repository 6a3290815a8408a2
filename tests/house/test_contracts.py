"""Questions that are asked in one word: whether a stage or model is in real time, and of which kind a stage is.

Static or real time is `in_real_time` of a scene's Stage and of either Model and State; the functions of that name, and `is_real`,
alone look at what it is kept as. A kind of stage is a row of coupler_protocol/scene/stage_kinds.py: code asks for a value of the
row, never for the kind's name. A kind's own function stands under its name in fdm_server/procedure/kinds.py.
"""

import ast

import pytest

from coupler_protocol.scene import stage_kinds
from tests.house.tree import PACKAGES, ROOT, files

TIMES = ("static", "real")
KEPT_AS = {"real_time", "dt"}  # fields that are None in static mode; arguments of kernels are asked for None, by numba's leave
ANSWER = ("in_real_time", "is_real")
ASK = {"index", "count", "last_frame", "begin", "progress"}  # calls that would look for a stage by the name of its kind


def trees(folders, root):
    """Path from the root and syntax tree of every Python file."""
    paths = (path for path in files(folders, root) if path.suffix == ".py")
    return [(path.relative_to(root).as_posix(), ast.parse(path.read_text(encoding="utf-8"))) for path in paths]


def texts(node):
    """Strings that a side of a comparison is made of."""
    parts = node.elts if isinstance(node, ast.Tuple | ast.List | ast.Set) else [node]
    return {part.value for part in parts if isinstance(part, ast.Constant) and isinstance(part.value, str)}


def sides(node):
    """Both sides, or more, of a comparison."""
    return [node.left, *node.comparators]


def kept_as(node, also=()):
    """Whether an expression is a field by which a model or state keeps its mode."""
    name = getattr(node, "attr", getattr(node, "id", ""))
    return name == "real_time" or (isinstance(node, ast.Attribute) and name in {*KEPT_AS, *also})


def truths(node):
    """Expressions whose truth a node asks for."""
    if isinstance(node, ast.If | ast.IfExp | ast.While | ast.Assert):
        return [node.test]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        return [node.operand]
    return node.values if isinstance(node, ast.BoolOp) else []


def put_aside(node):
    """Expressions that a node gives a name, to be asked later."""
    value = node.value if isinstance(node, ast.Assign) else None
    return value.elts if isinstance(value, ast.Tuple) else [value]


def asks_for_time(node):
    """Whether a node asks for static or real time by anything but the one word."""
    if isinstance(node, ast.Compare):
        if any(text in TIMES for side in sides(node) for text in texts(side)):
            return True
        none = any(isinstance(side, ast.Constant) and side.value is None for side in sides(node))
        owner = ast.unparse(node.left.value) if isinstance(node.left, ast.Attribute) else ""
        factor = ("step_factor",) if owner.endswith(("model", "self")) else ()  # a stage's key may be asked for
        return none and any(kept_as(side, factor) for side in sides(node))
    return any(isinstance(part, ast.Attribute) and part.attr == "real_time" for part in (*truths(node), *put_aside(node)))


def questions(tree):
    """Nodes of a tree, but for what stands in the functions that answer."""
    stack = [tree]
    while stack:
        node = stack.pop()
        yield node
        stack += [child for child in ast.iter_child_nodes(node) if not answers(child)]


def answers(node):
    """Whether a node is a function that does nothing but answer: a docstring and one return."""
    if not isinstance(node, ast.FunctionDef) or node.name not in ANSWER:
        return False
    return len(node.body) == 2 and isinstance(node.body[1], ast.Return)


def asks_for_kind(node):
    """Whether a node asks for the name of a kind of stage."""
    if isinstance(node, ast.Compare):
        return any(text in stage_kinds.NAMES for side in sides(node) for text in texts(side))
    name = getattr(node.func, "attr", getattr(node.func, "id", "")) if isinstance(node, ast.Call) else ""
    return name in ASK and any(text in stage_kinds.NAMES for part in node.args for text in texts(part))


def violations(asks, folders, root):
    """Where and how a question is not asked in its one word."""
    for path, tree in trees(folders, root):
        yield from (f"{path}:{node.lineno}: {ast.unparse(node)}" for node in questions(tree) if asks(node))


def test_static_or_real_time_is_asked_in_one_word():
    found = list(violations(asks_for_time, (*PACKAGES, "scripts"), ROOT))
    assert not found, "\n".join(found)


def test_kinds_of_stages_are_asked_by_their_rows():
    found = list(violations(asks_for_kind, PACKAGES, ROOT))
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ('if stage.time == "real": pass', 1),
        ('static = "static" != scene.stage[1].time', 1),
        ('real = table.get("time") in ("real",)', 1),
        ("most = 1 if side.model.real_time is not None else 2", 1),
        ("if before is None or real_time is None: pass", 1),
        ("if not model.real_time: pass", 1),
        ("before, model = model.real_time, None", 1),
        ("seconds = state.dt if state.dt is not None else 1.0", 1),
        ("static = model.step_factor is None", 1),
        ("if stage.step_factor is not None: pass", 0),
        ("if dt is None: pass", 0),
        ("if model.in_real_time: step = model.real_time * longest", 0),
        ('def in_real_time(self):\n    """Doc."""\n    return self.dt is not None', 0),
        ("def in_real_time(model):\n    model = 1\n    if model.real_time is None: pass", 1),
    ],
)
def test_a_planted_question_for_time_is_found(tmp_path, line, found):
    (tmp_path / "planted.py").write_text(line + "\n", encoding="utf-8")
    assert len(list(violations(asks_for_time, ["."], tmp_path))) == found


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ('if stage.kind == "couple": pass', 1),
        ('later = [s for s in stages if s["kind"] not in ("fill", "locate")]', 1),
        ('first = kinds.index("couple") if "couple" in kinds else 0', 2),
        ('frame = run.last_frame("couple")', 1),
        ('if grid.kind == "ring" or stage.name == "footing": pass', 0),
        ("if of(stage).couples or stage.excavate is not None: pass", 0),
    ],
)
def test_a_planted_question_for_a_kind_is_found(tmp_path, line, found):
    (tmp_path / "planted.py").write_text(line + "\n", encoding="utf-8")
    assert len(list(violations(asks_for_kind, ["."], tmp_path))) == found
