"""Moduli of a scene: bulk and shear modulus, or Young's modulus and Poisson's ratio."""

import pytest
from pydantic import ValidationError

from fdm_server.effects.elastic import Elastic, poisson_ratio, young_modulus


@pytest.mark.parametrize(("young", "poisson"), [(100e6, 0.3), (20e9, 0.0), (5e6, 0.49), (1e9, -0.2)])
def test_young_and_poisson_are_bulk_and_shear(young, poisson):
    found = Elastic(young=young, poisson=poisson)
    assert found.bulk == pytest.approx(young / (3 * (1 - 2 * poisson)), rel=1e-15)
    assert found.shear == pytest.approx(young / (2 * (1 + poisson)), rel=1e-15)
    assert young_modulus(found) == pytest.approx(young, rel=1e-12)
    assert poisson_ratio(found) == pytest.approx(poisson, abs=1e-12)
    assert Elastic(**found.model_dump()) == found  # a resolved scene is read as itself


def test_the_pair_of_the_published_example():
    """Griffiths & Lane (1999): E = 100 MPa, nu = 0.3."""
    found = Elastic(young=100e6, poisson=0.3)
    assert (found.bulk, found.shear) == pytest.approx((83.33e6, 38.46e6), rel=1e-3)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"bulk": 1e8, "shear": 4e7, "young": 1e8, "poisson": 0.3}, "bulk and shear and young and poisson: not a pair"),
        ({"bulk": 1e8, "young": 1e8}, "bulk and young: not a pair"),
        ({"young": 1e8}, "young: not a pair"),
        ({"young": 1e8, "poisson": 0.5}, "less than 0.5"),
        ({"young": -1e8, "poisson": 0.2}, "greater than 0"),
        ({"young": "1e8", "poisson": 0.2}, "is not a number"),
    ],
)
def test_what_is_no_pair_is_refused_once(keys, words):
    with pytest.raises(ValidationError) as found:
        Elastic(**keys)
    (error,) = found.value.errors()
    assert words in error["msg"]
