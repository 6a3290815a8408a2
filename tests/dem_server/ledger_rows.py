"""The energy ledger of discs without a rim, step by step, for tests."""

import numpy as np

from dem_server.observe.energy_ledger import Ledger
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free


def ledger_rows(model, state, steps, gravity=0.0, after=lambda: None):
    """Rows of the ledger: a dictionary of arrays (steps,); after() is called at the end of each step."""
    ledger, rows = Ledger(model, state), []
    for _ in range(steps):
        ledger.copy_before_step(state, gravity)
        move_free(model, state, gravity)
        ledger.book_motion(model, state, gravity)
        rows.append(ledger.values(model, state))
        ledger.copy_contacts(model, state)
        contact_forces(model, state)
        ledger.book_contacts(model, state)
        after()
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}
