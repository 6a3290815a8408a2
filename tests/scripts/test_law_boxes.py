"""What a law allocates, and that nobody else pays for it."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))
from bench.laws import LAWS, PLASTIC, Box


def arrays(*laws):
    return {name for name in Box(16, 16, laws).bytes() if name.startswith(("state", "ledger"))}


def test_a_law_allocates_its_own_arrays_only():
    least = arrays("elastic")
    assert {"state.stress", "state.velocity"} <= least
    assert arrays("elastic", "local") == least
    assert arrays("elastic", "real_time") == least
    assert arrays("elastic", "rayleigh") == least
    assert arrays("elastic", "combined") - least == {"state.previous_force"}
    assert arrays("elastic", "large_strain") - least == {"state.mass"}
    assert arrays("elastic", "mohr_coulomb") - least == {"state.plastic"}
    assert arrays(*PLASTIC) == arrays("elastic", "mohr_coulomb")
    assert arrays(*PLASTIC, "softening") - arrays(*PLASTIC) == {"state.plastic_shear"}
    assert {name.partition(".")[0] for name in arrays("elastic", "energy") - least} == {"ledger"}


def test_bytes_are_those_of_the_arrays():
    assert Box(16, 16, (*PLASTIC, "softening")).bytes()["state.plastic_shear"] == 8.0
    assert Box(16, 16, ("combined",)).bytes()["state.previous_force"] == 16 * 17**2 / 16**2


@pytest.mark.parametrize("law", LAWS)
def test_every_law_takes_steps(law):
    box = Box(4, 4, ("elastic", "mohr_coulomb", law), flowing=True)
    for _ in range(40):
        box.step()
    assert (box.state.plastic & 1).all()


def test_unknown_laws_are_named():
    with pytest.raises(ValueError, match="no laws of this project: glue; there are elastic"):
        Box(2, 2, ("glue",))
