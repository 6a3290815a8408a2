"""Threads that share a step: every part once, in threads of their own, errors to the one who asked."""

import threading

import pytest

from coupler_protocol.compiled import threads as team


def test_every_part_is_done_once_and_answers_in_its_place():
    assert team.each(lambda a, b: (a, b), [(0, 3), (3, 5), (5, 9)]) == [(0, 3), (3, 5), (5, 9)]


def test_parts_run_at_the_same_time_in_threads_of_their_own():
    meeting = threading.Barrier(2, timeout=10)
    threads = team.each(lambda part: (meeting.wait(), threading.get_ident())[1], [(0,), (1,)])
    assert len(set(threads)) == 2
    assert threads[0] == threading.get_ident()


def test_one_part_stays_in_the_thread_that_asks():
    assert team.each(lambda part: threading.get_ident(), [(0,)]) == [threading.get_ident()]


def test_an_error_in_another_thread_reaches_the_one_who_asks():
    def work(part):
        if part == 1:
            raise ArithmeticError("part 1")

    with pytest.raises(ArithmeticError, match="part 1"):
        team.each(work, [(0,), (1,)])


def test_threads_of_two_that_ask_at_once_do_not_wait_for_each_other():
    """Six parts in all meet, three of each: with threads in common some would wait for a thread that another part holds."""
    meeting = threading.Barrier(6, timeout=10)

    def ask(answers):
        answers += team.each(lambda part: meeting.wait(), [(0,), (1,), (2,)])

    found = [], []
    asking = [threading.Thread(target=ask, args=(answers,)) for answers in found]
    for thread in asking:
        thread.start()
    for thread in asking:
        thread.join()
    assert sorted(found[0] + found[1]) == [0, 1, 2, 3, 4, 5]
