"""Build a wheel with all that a project outside of a clone needs; see dragdeck/shipped.py."""

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

SHIPPED = ("config", "meshes", "profiles", "studies", "templates", "workflow")
LEFT_OUT = shutil.ignore_patterns("*.py", "__pycache__", "dragdeck*", "snakemake_*", "stability")


class BuildWithShipped(build_py):
    """Copy folders of the clone's root into the package."""

    def run(self) -> None:
        """Build the packages, then copy; not for an editable installation."""
        super().run()
        share = Path(self.build_lib, "dragdeck/share")
        for name in () if self.editable_mode else SHIPPED:
            shutil.rmtree(share / name, ignore_errors=True)
            shutil.copytree(name, share / name, ignore=LEFT_OUT)


setup(cmdclass={"build_py": BuildWithShipped})
