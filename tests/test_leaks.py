"""The leak check of conftest.py can fail, for each thing it looks for."""

import subprocess
import sys
import threading

import pytest


def test_an_open_file_is_a_leak(leak_check, tmp_path):
    held = []
    with pytest.raises(pytest.fail.Exception, match=r"left behind: file .*leak"), leak_check():
        held.append((tmp_path / "leak").open("wb"))
    held.pop().close()


def test_a_running_thread_is_a_leak(leak_check):
    release = threading.Event()
    thread = threading.Thread(target=release.wait, name="forgotten")
    with pytest.raises(pytest.fail.Exception, match="left behind: thread forgotten"), leak_check():
        thread.start()
    release.set()
    thread.join()


def test_a_child_process_is_a_leak(leak_check):
    with pytest.raises(pytest.fail.Exception, match=r"left behind: .*process \d+"), leak_check():
        child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    child.communicate(b"\n")


def test_what_is_closed_again_is_not_a_leak(leak_check, tmp_path):
    with leak_check():
        with (tmp_path / "file").open("wb"):
            pass
        thread = threading.Thread(target=int)
        thread.start()
        thread.join()
        subprocess.run([sys.executable, "-c", ""], check=True)
