"""Messages of a person come before results, each kind in its order, from any thread."""

from __future__ import annotations

from threading import Thread

from station.capture_loop.inbox import Inbox


def test_messages_come_before_results_and_each_kind_in_its_order() -> None:
    inbox = Inbox[int]()
    for number in (1, 2):
        inbox.put_result(number)
    for number in (3, 4):
        inbox.put(number)
    assert [inbox.get() for _ in range(3)] == [3, 4, 1]
    inbox.put(5)
    assert [inbox.get(), inbox.empty(), inbox.get(), inbox.empty()] == [5, False, 2, True]


def test_one_waits_for_a_message_of_another_thread() -> None:
    inbox = Inbox[int]()
    thread = Thread(target=inbox.put_result, args=(7,))
    thread.start()
    assert inbox.get() == 7
    thread.join()
