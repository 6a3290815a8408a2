"""Laws that other distributions add: a file of one law, declared as `material.NAME` in the entry points `colluvium.effects`.

The file contains the following names:

    class NAME(Effect)                        keys of the table in a scene's material
    class Parameters(NamedTuple)              numbers that the law reads in a zone
    parameters(table, elastic)                Parameters of one material; for a material without the law, table is None:
                                              numbers with which the law changes nothing
    corrected(sm, zz, sd, xy, p)              (sm, zz, sd, xy) [Pa] of a triangle after the law, from those before it (defined
                                              in elastic.py), with p the Parameters
    HISTORIES = (History(name, "zone"),)      if the law has a history of one number; then corrected(sm, zz, sd, xy, memory, p)
                                              -> (sm, zz, sd, xy, memory)

`corrected` is compiled into the step (step/added_laws.py): it may call functions of `math` only. Stresses within the limits of
the law are returned unchanged. Added laws act after Mohr-Coulomb and the tension cut-off, in the order of their names.
"""

import re
import sys

import numpy as np

from coupler_protocol.files.quantities import FIELDS
from coupler_protocol.scene.scene import declared_effects
from fdm_server.effects import mohr_coulomb, softening, tension

TABLE = "material"
OWN = ("elastic", "mohr_coulomb", "tension", "softening")  # tables of materials that `Law` has fields for
OWN_HISTORIES = frozenset(h.name for law in (mohr_coulomb, tension, softening) for h in law.HISTORIES)
OWN_FIELDS = frozenset(FIELDS)  # before laws add theirs
NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")


def declared():
    """Installed laws of other distributions: {name of the table: class of its keys}."""
    places = ((place.partition("."), effect) for place, effect in declared_effects().items())
    return {name: effect for (table, _, name), effect in places if table == TABLE and name not in OWN}


def parameters(materials):
    """Parameters (M,) of every added law of the M materials, a named tuple for each law; None without such a law."""
    found = []
    for name, effect in sorted(declared().items()):
        if any(getattr(m, name, None) is not None for m in materials):
            law = module_of(effect)
            rows = [law.parameters(getattr(m, name, None), m.elastic) for m in materials]
            found.append(law.Parameters(*np.array(rows, dtype=np.float64).T.copy()))
    return tuple(found) or None


def module_of(cls):
    """The law file that contains a class: of its keys, or of its Parameters."""
    return sys.modules[cls.__module__]


def histories(parameters_class):
    """Histories of the law with this class of Parameters."""
    return getattr(module_of(parameters_class), "HISTORIES", ())


def memories(laws, memory):
    """History (B, 16) of each added law or None, from {name: array}."""
    return tuple(next((memory[history.name] for history in histories(type(law))), None) for law in laws)


def missing(effect):
    """Text of the parts that a law file lacks; "" if it is complete."""
    law = module_of(effect)
    lacks = [f"no function `{name}`" for name in ("parameters", "corrected") if not callable(getattr(law, name, None))]
    fields = getattr(getattr(law, "Parameters", None), "_fields", ())
    lacks += [] if fields else ["no named tuple `Parameters` with a field"]
    remembered = getattr(law, "HISTORIES", ())
    if len(remembered) > 1 or any((h.place, h.components, h.dtype) != ("zone", 1, "f8") for h in remembered):
        lacks.append("HISTORIES that are not one number (f8) per zone")
    lacks += [fault for h in remembered for fault in _names_at_fault(effect, h)]
    return ", ".join(lacks)


def _names_at_fault(effect, history):
    """Texts of what is wrong with the names of a history: they name arrays in checkpoints and frames beside ours."""
    others = [h for cls in declared().values() if cls is not effect for h in getattr(module_of(cls), "HISTORIES", ())]
    for kind, name, own, theirs in (
        ("history", history.name, OWN_HISTORIES, {h.name for h in others}),
        ("recorded field", history.recorded, OWN_FIELDS, {h.recorded for h in others}),
    ):
        if not isinstance(name, str) or not (NAME.fullmatch(name) or (kind != "history" and name == "")):
            yield f"a {kind} with the name {name!r}: use small letters, digits and _"
        elif name and (name in own or name in theirs):
            yield f"a {kind} with the name {name!r}, which {'colluvium' if name in own else 'another law'} has: use another name"
