"""Files are either whole or not there."""

import os
from pathlib import Path

import pytest
import pyvista as pv

from dragdeck.files import write_vtp


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_mesh_that_does_not_fit_on_the_disk_is_an_error(tmp_path: Path) -> None:
    (tmp_path / f".body.vtp.{os.getpid()}").symlink_to("/dev/full")
    with pytest.raises(OSError, match="No space left"):
        write_vtp(tmp_path / "body.vtp", pv.Sphere())
    assert not any(tmp_path.iterdir())
