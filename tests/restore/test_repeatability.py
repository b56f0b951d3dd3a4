"""The same scan gives the same page to the byte, whether the kernels were compiled just now or are kept from before."""

import hashlib
import os
import shutil
import subprocess
import sys

import pytest

PROGRAM = """
import hashlib
from restore import Settings, restore
from station.run.small_page import small_page
page = restore(small_page(), Settings(points=10_000, shading="remove"))
print(hashlib.sha256(page.image.tobytes() + page.page_map.tobytes() + page.fine.flat.tobytes()).hexdigest())
"""


@pytest.mark.slow
def test_a_page_does_not_depend_on_whether_its_kernels_were_kept(tmp_path, repository):
    for package in ("drivers", "restore", "station"):
        without_kernels = shutil.ignore_patterns("__pycache__", "configs")
        shutil.copytree(repository / package, tmp_path / package, ignore=without_kernels)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    command = [sys.executable, "-c", PROGRAM]
    compiled, kept = (
        subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    )
    assert len(compiled.strip()) == 2 * hashlib.sha256().digest_size
    assert compiled == kept
