"""What the laws of the grid remember: the arrays that they declare, as fields of State.

A law file declares its arrays once, as `HISTORIES`. From there they are fields of State, zero at first if the law acts and None
if not, and go by their place (zone or gridpoint) through removed zones, into checkpoints and, if they are `recorded`, into
frames. What a law from another distribution remembers (added_laws.py) is in State.memory, by its name.
"""

from dataclasses import field, make_dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fdm_server.effects import combined_damping, mohr_coulomb, softening, tension

# law files by field of Law
EFFECTS = {"mohr_coulomb": mohr_coulomb, "tension": tension, "softening": softening, "combined": combined_damping}


def declared(effects):
    """Histories {name: History} that the law files of `effects` declare; laws may share one."""
    return {history.name: history for module in effects.values() for history in module.HISTORIES}


def fields_of(histories):
    """Dataclass of the fields of State for these histories {name: History}; each says its place, and is None at first."""
    kinds = {name: Annotated[NDArray[np.dtype(h.dtype).type] | None, h.place] for name, h in histories.items()}
    names = [(name, kind, field(default=None)) for name, kind in kinds.items()]
    return make_dataclass("OfLaws", names, kw_only=True, slots=True, namespace={"__module__": __name__})


DECLARED = declared(EFFECTS)
OfLaws = fields_of(DECLARED)
