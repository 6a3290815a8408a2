"""Threads in one compiled loop: they meet, they add what they found, and nobody waits for one that is gone."""

import threading
import time

import numpy as np
import pytest

from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.thread_crew import (
    END,
    LOOKS,
    PAUSE,
    await_order,
    crew_of,
    lead,
    meet,
    order,
    over_all_threads,
    part_of,
    work_together,
)


@jit(package="dem_server")
def behind(turns, written, crew):
    """How often another thread's number was not that of this turn, after they had met."""
    wrong = 0
    for turn in range(turns):
        written[crew.rank] = turn
        meet(crew)
        for other in range(crew.size):
            wrong += written[other] != turn
        meet(crew)
    return wrong


@pytest.mark.parametrize("size", [1, 2, 3])
def test_after_a_meeting_all_see_what_each_wrote(size):
    written = np.zeros(size)
    work = work_together(lambda _, counts, crew: behind(2000, written, crew), [(k,) for k in range(size)], np.zeros(1, int))
    assert work == [0] * size


def test_counts_are_added_and_findings_are_those_of_all():
    def work(fast, speed, counts, crew):
        counts[0] += fast
        return *over_all_threads(crew, fast, speed, crew.rank == 0), threading.get_ident()

    counters = np.array([10])
    (*one, here), (*two, there) = work_together(work, [(2, 0.5), (3, 4.0)], counters)
    assert one == two == [5, 4.0, True]
    assert counters == 15
    assert here == threading.get_ident() != there


def test_parts_of_all_cover_the_range_once():
    def work(_, counts, crew):
        return part_of(crew, 3, 10)

    assert work_together(work, [(0,)] * 3, np.zeros(1, int)) == [(3, 5), (5, 7), (7, 10)]


def test_nobody_waits_for_a_thread_that_failed():
    def work(part, counts, crew):
        if part == 1:
            raise ArithmeticError("part 1")
        meet(crew)
        meet(crew)

    with pytest.raises(ArithmeticError, match="part 1"):
        work_together(work, [(0,), (1,)], np.zeros(1, int))


@jit(package="dem_server")
def add_as_ordered(crew, total):
    """Adds ordered numbers to the total of this thread until the first one leaves; returns how many orders there were."""
    count = 0
    while True:
        await_order(crew)
        if crew.ordered[0] == END:
            return count
        total[crew.rank] += crew.ordered[0] * crew.ordered[1]
        count += 1
        meet(crew)


@jit(package="dem_server")
def order_numbers(crew, most):
    """Orders the numbers up to `most`."""
    for number in range(most):
        order(crew, 2.0, float(number), 0.0)
        meet(crew)
    return most


def test_threads_help_the_first_one_until_it_leaves():
    crew, total, counted = crew_of(3), np.zeros(3), []
    for _ in range(2):
        assert lead(crew, lambda: order_numbers(crew, 1000), lambda own: counted.append(add_as_ordered(own, total))) == 1000
    assert counted == [1000] * 4
    assert total.tolist() == [0.0, 2 * 999000.0, 2 * 999000.0]
    assert crew_of(1) is None


def test_a_thread_that_rests_is_there_for_the_next_order():
    crew, total = crew_of(2), np.zeros(2)

    def work():
        for _ in range(3):
            time.sleep(1e-6 * LOOKS * PAUSE)
            order_numbers(crew, 10)

    lead(crew, work, lambda own: add_as_ordered(own, total))
    assert total.tolist() == [0.0, 3 * 90.0]


def test_the_first_thread_does_not_wait_for_one_that_failed():
    def fail(crew):
        raise ArithmeticError("no help")

    crew = crew_of(2)
    with pytest.raises(ArithmeticError, match="no help"):
        lead(crew, lambda: order_numbers(crew, 3), fail)
