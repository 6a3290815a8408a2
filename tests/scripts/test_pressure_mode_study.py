"""scripts/studies/pressure_mode_study.py: averages at gridpoints take the pressure mode of a footing, not its load."""

import pressure_mode_study


def test_nodal_averages_leave_a_fifth_of_the_mode_and_the_load_of_prandtl(capsys):
    assert pressure_mode_study.main(["--fast"]) == 0
    rows = [line.split("|")[1:-1] for line in capsys.readouterr().out.splitlines()[2:]]
    assert [row[1].strip() for row in rows] == ["zone", "nodal"]
    load, zones, smooth, work = (dict(zip(pressure_mode_study.KINDS, column, strict=True)) for column in numbers(rows))
    assert zones["zone"] > 10.0
    assert 0.0 < zones["nodal"] < 4.0
    assert max(smooth.values()) < 1.0
    assert 0.0 < load["zone"] < 3.0
    assert -0.5 < load["nodal"] < load["zone"]
    assert work["zone"] == 0.0 < work["nodal"] < 1.0


def numbers(rows):
    """Columns after the first two [%]."""
    return [[float(cell.strip().rstrip("%")) for cell in column] for column in list(zip(*rows, strict=True))[2:]]
