"""Histories of pairs: the arrays that the effects declare, and all operations on them.

An effect file declares its arrays once, as `HISTORIES`. By this declaration they are fields of State, empty at first, are copied
from an old list of pairs to a new one, to checkpoints, to frames and, as a `PairHistory`, to the kernels. A dot in the name puts
several arrays of one effect under one field: `parallel.gap` is field `gap` of State.parallel. The field of an absent effect is
None.
"""

import sys
from dataclasses import field, make_dataclass
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from dem_server.effects import TABLES

DECLARED = {effect: getattr(sys.modules[table.__module__], "HISTORIES", ()) for effect, table in TABLES.items()}


def _fields():
    """Histories by their field in State: one, or for names with a dot {field of the field: history}."""
    found = {}
    for history in (history for histories in DECLARED.values() for history in histories):
        name, _, part = history.name.partition(".")
        if part:
            found.setdefault(name, {})[part] = history
        else:
            found[name] = history
    return found


def _several(name):
    """Class of a field with several arrays, and its name in this module, by which kernels find it."""
    parts = [(part, np.ndarray) for part in FIELDS[name]]
    globals()[name.capitalize()] = found = NamedTuple(name.capitalize(), parts)
    found.__module__ = __name__
    return found


FIELDS = _fields()
CLASSES = {name: _several(name) if isinstance(declared, dict) else np.ndarray for name, declared in FIELDS.items()}
PairHistory = NamedTuple("PairHistory", [(name, cls | None) for name, cls in CLASSES.items()])
OfPairs = make_dataclass(
    "OfPairs",
    [(name, cls | None, field(default=None)) for name, cls in CLASSES.items()],
    kw_only=True,
    namespace={"__module__": __name__},
)  # the histories of pairs in State
_arrays_of = attrgetter(*PairHistory._fields)  # called in every step


def histories_of(law, reference_gap=True):
    """Declared histories of pairs under this Law; `reference_gap`: whether contacts have one."""
    absent = {name for name, there in (("shear", law.has_shear), ("reference_gap", reference_gap)) if not there}
    present = (histories for effect, histories in DECLARED.items() if getattr(law, effect) is not None)
    return [history for histories in present for history in histories if history.name not in absent]


def empty(law, reference_gap=True):
    """Fields of State {name: empty arrays} for a Law."""
    there = {history.name for history in histories_of(law, reference_gap)}
    found = {}
    for name, declared in FIELDS.items():
        if isinstance(declared, dict):
            if f"{name}.{next(iter(declared))}" in there:
                found[name] = CLASSES[name](*(np.zeros(0, history.dtype) for history in declared.values()))
        elif name in there:
            found[name] = np.zeros(0, declared.dtype)
    return found


def history_of(state):
    """The PairHistory of a State, without copies of its arrays."""
    return PairHistory._make(_arrays_of(state))


def each_array(change, value):
    """Applies `change` to an array, or to each array of a named tuple; None remains None."""
    if value is None:
        return None
    return change(value) if isinstance(value, np.ndarray) else type(value)(*(each_array(change, item) for item in value))


def copied(state):
    """A PairHistory of a State with copies of its arrays."""
    return each_array(np.copy, history_of(state))


def carry_to_new_list(state, origin):
    """Copies histories from pair origin[p] (m,) of the old list to pair p of a new one; zero if origin[p] is -1."""
    there = origin >= 0
    known = origin[there]

    def carried(array):
        new = np.zeros(len(origin), dtype=array.dtype)
        new[there] = array[known]
        return new

    for name in PairHistory._fields:
        setattr(state, name, each_array(carried, getattr(state, name)))


def recorded(state):
    """Arrays over the listed pairs for frames, by their names in frames."""
    found = {}
    for histories in DECLARED.values():
        for history in histories:
            name, _, part = history.name.partition(".")
            value = getattr(state, name)
            if history.recorded and value is not None:
                found[history.recorded] = getattr(value, part) if part else value
    return found


def fields_recorded(law):
    """Fields of contacts {name in frames: type} under a Law: those of `recorded`, and the shear force where there is one."""
    found = {history.recorded: history.dtype for history in histories_of(law) if history.recorded}
    return found | ({"shear_force": "f8"} if law.has_shear else {})
