"""What the page asks for: in order, and numbers that are still being typed only when complete."""

import time
from threading import Thread

from notchflex.viewer.tasks import Tasks


def done(tasks, timeout=0.0):
    """Do what is ready."""
    while (task := tasks.take(timeout)) is not None:
        task()


def test_tasks_are_done_in_order():
    tasks, seen = Tasks(), []
    for number in range(3):
        tasks.add(lambda number=number: seen.append(number))
    done(tasks)
    assert seen == [0, 1, 2]
    assert tasks.take() is None


def test_a_number_waits_for_a_pause_and_the_last_one_counts():
    tasks, seen = Tasks(), []
    for text in ("1", "1.", "1.5"):
        tasks.add(lambda text=text: seen.append(float(text)), "field", 0.3)
        done(tasks)
    assert seen == []
    assert tasks.has("field")
    started = time.monotonic()
    done(tasks, 2.0)
    assert seen == [1.5]
    assert time.monotonic() - started > 0.25
    assert not tasks.has("field")


def test_whatever_comes_after_a_number_ends_the_pause():
    tasks, seen = Tasks(), []
    tasks.add(lambda: seen.append("typed"), "field", 100.0)
    tasks.add(lambda: seen.append("button"))
    done(tasks)
    assert seen == ["typed", "button"]


def test_numbers_of_other_fields_are_kept():
    tasks, seen = Tasks(), []
    tasks.add(lambda: seen.append("a"), "a", 100.0)
    tasks.add(lambda: seen.append("b"), "b", 0.0)
    tasks.add(lambda: seen.append("a again"), "a", 0.0)
    done(tasks)
    assert seen == ["a", "b", "a again"]


def test_whoever_waits_is_woken():
    tasks, seen = Tasks(), []
    waiting = Thread(target=lambda: (tasks.take(30.0) or seen.append)(*[]))
    waiting.start()
    tasks.add(lambda: seen.append("done"))
    waiting.join(10.0)
    assert seen == ["done"]
