"""scripts/verify.py: rows as promised, failures that count, and a page of which only the own section changes."""

import json
import re
from types import SimpleNamespace

import pages
import pytest
import verify
from verification import SECTIONS, runner
from verification.verdict_rows import KEYS, row

from tests.commands import ROOT


def case(name, *rows_of):
    """A case that yields these rows."""
    return SimpleNamespace(NAME=name, __doc__="Title.\n\nText.", rows=lambda fast: iter(rows_of))


def test_rows_have_exactly_the_keys_of_the_contract(tmp_path):
    files = ["--json", str(tmp_path / "rows.json"), "--page", str(tmp_path / "page.md")]
    assert verify.main(["continuum", "--fast", "--case", "patch", *files]) == 0
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert len(rows) == 6
    assert all(tuple(found) == KEYS for found in rows)
    assert all(found["case"] == "patch" and found["passed"] and abs(found["error"]) <= found["tolerance"] for found in rows)
    assert not (tmp_path / "page.md").exists()  # some cases are no section


def test_an_unknown_case_is_an_error_of_the_command_line(capsys):
    assert verify.main(["continuum", "--case", "patches"]) == 2
    assert "there are oedometer, " in capsys.readouterr().err


def test_a_row_outside_its_tolerance_fails():
    assert row("x", 1.02, 1.0, 0.03, "s")["passed"]
    assert not row("x", 1.04, 1.0, 0.03, "s")["passed"]
    assert row("x", 1.02, 1.0, [0.0, 0.03], "s")["passed"]
    assert not row("x", 0.99, 1.0, [0.0, 0.03], "s")["passed"]
    assert not row("x", float("nan"), 1.0, 0.03, "s")["passed"]
    assert row("x", 1e-11, 0.0, 1e-10, "s")["error"] == 1e-11  # absolute where the reference is 0


def test_a_case_that_breaks_off_fails_and_others_go_on():
    def broken(fast):
        yield row("before", 1.0, 1.0, 0.1, "s")
        raise ArithmeticError("inverted")

    cases = [SimpleNamespace(NAME="a", rows=broken), case("b", row("q", 1.0, 1.0, 0.1, "s"))]
    rows = runner.run(cases, fast=True)
    assert [(found["case"], found["passed"]) for found in rows] == [("a", True), ("a", False), ("b", True)]
    assert "inverted" in rows[1]["source"]
    assert all(tuple(found) == KEYS for found in rows)


@pytest.mark.parametrize(("value", "code"), [(1.0, 0), (2.0, 1)])
def test_exit_code_and_page(tmp_path, monkeypatch, value, code):
    package = SimpleNamespace(TITLE="Continuum", HEAD="Head.", CASES=[case("one", row("q", value, 1.0, 0.1, "closed form"))])
    monkeypatch.setattr(runner, "section", lambda name: package)
    page = tmp_path / "page.md"
    pages.write_section(page, "discrete", "kept", "# Head")
    pages.write_section(page, "continuum", "old")
    pages.write_section(page, "hard", "kept as well")
    assert verify.main(["continuum", "--page", str(page)]) == code
    text = page.read_text()
    assert "old" not in text
    assert f"{1 - code} of 1 rows passed" in text
    assert "<!-- begin discrete -->\nkept\n<!-- end discrete -->" in text
    assert "<!-- begin hard -->\nkept as well\n<!-- end hard -->" in text
    assert text.index("discrete") < text.index("continuum") < text.index("hard")


def test_continuous_integration_runs_the_short_form_of_every_section_but_hard():
    """tests/hard runs the cases of that one."""
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    (named,) = re.findall(r"^for section in (.*); do\n.* scripts/verify\.py \"\$section\" --fast .*\ndone$", script, re.MULTILINE)
    assert sorted([*named.split(), "hard"]) == sorted(SECTIONS)


def test_continuous_integration_runs_the_tests_that_the_test_command_leaves_out():
    commands = (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    tests = [line.partition(" -m pytest ")[2] for line in commands if " -m pytest " in line]
    assert tests == ["-q", '-q -m "long and not trial"']


@pytest.mark.parametrize("section", SECTIONS)
def test_a_section_runs_all_its_cases_and_writes_its_part_of_the_page(tmp_path, monkeypatch, section):
    """Rows of the real cases are left to continuous integration: here each case has one that passes."""
    computed = runner.run

    def run(cases, fast, say):
        assert fast
        return computed([case(one.NAME, row("q", 1.0, 1.0, 0.1, "s")) for one in cases], fast, say)

    monkeypatch.setattr(runner, "run", run)
    page, file = tmp_path / "page.md", tmp_path / "rows.json"
    assert verify.main([section, "--fast", "--page", str(page), "--json", str(file)]) == 0
    rows = json.loads(file.read_text())
    assert [found["case"] for found in rows] == [case.NAME for case in runner.section(section).CASES]
    assert f"<!-- begin {section} -->" in page.read_text()
    assert f"`python scripts/verify.py {section} --fast`: {len(rows)} of {len(rows)} rows passed." in page.read_text()


@pytest.mark.parametrize("section", SECTIONS)
def test_every_case_has_a_name_a_title_and_its_place_on_the_page(section):
    package = runner.section(section)
    names = [found.NAME for found in package.CASES]
    assert len(set(names)) == len(names)
    page = verify.PAGE.read_text()
    for found in package.CASES:
        title = found.__doc__.partition("\n")[0].rstrip(".")
        assert f"### {found.NAME}: {title}" in page, f"run: python scripts/verify.py {section}"
        assert f"| {found.NAME} |" in page
