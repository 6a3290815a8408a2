"""Rows of the table: a value, what it should be, and whether it is."""

from math import isfinite

KEYS = ("case", "quantity", "value", "reference", "error", "tolerance", "passed", "seconds", "order", "source")


def row(quantity, value, reference, tolerance, source, order=None):
    """One row; the runner adds case and seconds.

    error: (value - reference)/|reference|, or value - reference where the reference is 0. tolerance: largest size of the error,
    or [lowest, highest] error. order: observed order of convergence, where there is one.
    """
    value, reference = float(value), float(reference)
    error = (value - reference) / (abs(reference) or 1.0)
    low, high = (-tolerance, tolerance) if isinstance(tolerance, int | float) else tolerance
    return {
        "case": "",
        "quantity": quantity,
        "value": value if isfinite(value) else None,
        "reference": reference,
        "error": error if isfinite(error) else None,
        "tolerance": tolerance if isinstance(tolerance, int | float) else [low, high],
        "passed": bool(low <= error <= high),
        "seconds": 0.0,
        "order": None if order is None else float(order),
        "source": source,
    }


def failure(quantity, reason):
    """The row of a case that did not get to its end."""
    empty = dict.fromkeys(("value", "reference", "error", "tolerance", "order"))
    return {"case": "", "quantity": quantity, **empty, "passed": False, "seconds": 0.0, "source": reason}
