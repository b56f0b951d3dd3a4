"""Only regular files of a limited size are opened."""

import os
import resource
import tracemalloc

import pytest

from restore.files import MAX_TOML_BYTES, MAX_TOML_LINE, read_regular, read_toml

PEAK_BYTES = 150 * 2**20  # the worst table within the limits; without them it takes gigabytes


def test_a_regular_file_is_read_whole(tmp_path):
    (tmp_path / "a").write_bytes(b"12345")
    assert read_regular(tmp_path / "a", 5) == b"12345"
    with pytest.raises(OSError, match="larger than 4 bytes"):
        read_regular(tmp_path / "a", 4)


def test_what_is_not_a_regular_file_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, fault in (
        (tmp_path / "pipe", "not a regular file"),
        ("/dev/zero", "not a regular file"),
        (tmp_path, "is a folder"),
        (tmp_path / "none", "No such file"),
    ):
        with pytest.raises(OSError, match=fault):
            read_regular(path, 100)


def test_a_sparse_file_is_refused_unread(tmp_path):
    with (tmp_path / "sparse").open("wb") as file:
        file.truncate(2**31)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(OSError, match="larger"):
        read_regular(tmp_path / "sparse", 2**20)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 2**10


DEEP = {
    "array": "a = " + "[" * 900 + "\n" + ("[" * 900 + "\n") * 50,
    "key": ".".join("a" * 30_000) + " = 1",
    "tables": "".join(f"{{a={chr(10) if k % 300 == 0 else ''}" for k in range(5000)),
}


@pytest.mark.parametrize("name", DEEP)
def test_deep_nesting_is_not_a_recursion_error(tmp_path, name):
    (tmp_path / "a.toml").write_text(DEEP[name])
    with pytest.raises(ValueError, match=r"."):
        read_toml(tmp_path / "a.toml")


def test_the_worst_keys_within_the_limits_take_bounded_memory(tmp_path):
    key = ".".join("a" * ((MAX_TOML_LINE - 20) // 2))
    lines = MAX_TOML_BYTES // (len(key) + 10)
    (tmp_path / "a.toml").write_text("".join(f"{key}.b{number} = 1\n" for number in range(lines)))
    tracemalloc.start()
    try:
        read_toml(tmp_path / "a.toml")
        assert tracemalloc.get_traced_memory()[1] < PEAK_BYTES
    finally:
        tracemalloc.stop()
