"""Where the numbers of messages stand: views into one buffer, in the order of protocol version 4."""

from types import SimpleNamespace

import numpy as np
import pytest

from coupler_protocol.wire import payloads
from coupler_protocol.wire.frames import HEADER, WireError
from coupler_protocol.wire.messages import FORCE, VELOCITY, Answer, Order

TALK = SimpleNamespace(session=7, rank=2)
K, B = 5, 3
RNG = np.random.default_rng(4)


def numbers(frame):
    return np.frombuffer(bytes(frame.buffer[HEADER.size :]), "<f8")


def test_a_force_holds_answer_forces_sums_and_strain_in_this_order():
    frame = payloads.ForceFrame(TALK, K, B)
    answer, force, sums, strain = RNG.random(len(Answer._fields)), RNG.random((K, 2)), RNG.random(K), RNG.random((B, 3))
    frame.scalars[:], frame.force[:], frame.sums[:], frame.strain[:] = answer, force, sums, strain
    assert numbers(frame).tolist() == [*answer, *force.ravel(), *sums, *strain.ravel()]
    assert (frame.kind, frame.session, frame.rank) == (FORCE, 7, 2)
    assert frame.answer == Answer(*answer.tolist())
    assert payloads.ForceFrame(TALK, K).strain.shape == (0, 3)


def test_a_velocity_holds_order_and_velocities():
    frame = payloads.VelocityFrame(TALK, K)
    order, velocity = RNG.random(len(Order._fields)), RNG.random((K, 2))
    frame.scalars[:], frame.velocity[:] = order, velocity
    assert numbers(frame).tolist() == [*order, *velocity.ravel()]
    assert frame.kind == VELOCITY
    assert frame.order == Order(*order.tolist())


def test_a_field_has_its_columns_by_name():
    place, area, stress, density = RNG.random((4, 2)), RNG.random(4), RNG.random((4, 3)), RNG.random(4)
    rows = payloads.field_of(payloads.field_content(payloads.field_rows(place, area, stress, density), 9.81, True))
    assert rows.tobytes() == np.column_stack([place, area, stress, density]).tobytes()
    for name, column in (("x", place[:, 0]), ("area", area), ("yy", stress[:, 1]), ("density", density)):
        assert (rows[:, getattr(payloads.FIELD, name)] == column).all(), name
    assert (rows[:, payloads.STRESS] == stress).all()
    with pytest.raises(WireError, match="another size"):
        payloads.field_of({"field": b"\0" * 8})


@pytest.mark.parametrize("change", ["no zones", "area", "density"])
def test_a_field_of_zones_that_cannot_be_is_refused(change):
    rows = RNG.random((0 if change == "no zones" else 3, 7))
    if len(rows):
        rows[1, getattr(payloads.FIELD, change)] = 0.0
    with pytest.raises(WireError, match="FIELD has no zones, or some without area or density"):
        payloads.field_of(payloads.field_content(rows, 9.81, True))


def test_a_ready_holds_one_mass_a_node():
    mass = RNG.random(K)
    content = payloads.ready_content(mass, {"discs": 9})
    assert payloads.inner_mass_of(content, K).tobytes() == mass.tobytes()
    with pytest.raises(WireError, match="another size"):
        payloads.inner_mass_of(content, K + 1)
