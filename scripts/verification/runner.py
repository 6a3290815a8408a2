"""Runs the cases of a section, prints their rows and writes the section of the page."""

import importlib
import inspect
import time
import traceback

import pages

from verification.verdict_rows import KEYS, failure


def section(name):
    """The package of a section."""
    return importlib.import_module(f"verification.{name}")


def run(cases, fast, show=lambda row: None):
    """All rows of the cases; seconds count from the row before. A case that breaks off becomes a failed row."""
    rows = []
    for case in cases:
        begin = time.perf_counter()
        try:
            for row in case.rows(fast):
                rows.append(_completed(row, case, begin))
                show(rows[-1])
                begin = time.perf_counter()
        except Exception as error:
            traceback.print_exc()
            rows.append(_completed(failure("completed", f"{type(error).__name__}: {error}"), case, begin))
            show(rows[-1])
    return rows


def _completed(row, case, begin):
    row = row | {"case": case.NAME, "seconds": time.perf_counter() - begin}
    return {key: row[key] for key in KEYS}


def _percent(value):
    if value is None:
        return "-"
    if value == 0.0:
        return "0"
    return f"{value:+.1e}" if abs(value) < 1e-3 else f"{100 * value:+.2f} %"


def _tolerance(value):
    if value is None:
        return "-"
    if isinstance(value, list):
        return " .. ".join(_percent(v) for v in value)
    return _percent(value).replace("+", "")


def _seconds(value):
    return f"{value:.2f}"


COLUMNS = {key: key for key in KEYS} | {
    "error": ("error", _percent),
    "tolerance": ("tolerance", _tolerance),
    "seconds": ("seconds", _seconds),
    "order": ("order", lambda value: "-" if value is None else f"{value:.2f}"),
}


def table(rows):
    """The rows for a terminal."""
    return pages.plain(rows, COLUMNS)


def page_section(package, rows, command, studies):
    """Markdown of a section: the table, then every case in words; studies: {name of a case: Markdown}."""
    passed = sum(row["passed"] for row in rows)
    parts = [f"## {package.TITLE}", f"`{command}`: {passed} of {len(rows)} rows passed.", package.HEAD]
    parts.append(pages.markdown(rows, COLUMNS))
    for case in package.CASES:
        title, _, text = inspect.getdoc(case).partition("\n")
        parts += [f"### {case.NAME}: {title.rstrip('.')}", text.strip(), studies.get(case.NAME, "")]
    return "\n\n".join(part for part in parts if part)
