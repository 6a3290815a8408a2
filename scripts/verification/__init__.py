"""Verification: one package of cases for each section of docs/verification.md; `SECTIONS` lists them.

A section is a package with TITLE, HEAD (a paragraph) and CASES, a list of modules. A case is a module with

    NAME, a docstring (first line: title; the rest: set-up and closed form, it becomes part of the page)
    rows(fast) -> iterator of rows made by verification.verdict_rows.row
    study(pictures) -> Markdown, optional: what stands beside the table; it may draw into the folder `pictures`
"""

SECTIONS = ("continuum", "discrete", "coupling", "hard")
