"""Records the programs of typical calls when a wheel is built; see `solver/programs/store.py`."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PARTS = 2


class RecordPrograms(BuildHookInterface):
    """Puts programs into the wheel; an editable installation gets none."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Run the typical calls; without their programs only first calls take longer."""
        if version == "editable":
            return
        root = Path(self.root)
        self.folder = tempfile.TemporaryDirectory()
        # pip hands the build's libraries to its processes by the same variable.
        paths = [str(root / "src"), *filter(None, [os.environ.get("PYTHONPATH")])]
        settings = {
            "PYTHONPATH": os.pathsep.join(paths),
            "NOTCHFLEX_RECORD_PROGRAMS": self.folder.name,
            "JAX_COMPILATION_CACHE_DIR": "",
            "JAX_PLATFORMS": "cpu",
            # A program that lanewise cannot compile would not be shipped: that must be seen.
            "PYTHONWARNINGS": "error:XLA compiles:RuntimeWarning",
        }
        calls = [
            subprocess.Popen(
                [sys.executable, root / "packaging" / "typical_calls.py", f"{part}/{PARTS}"],
                env={**os.environ, **settings},
            )
            for part in range(1, PARTS + 1)
        ]
        if any([call.wait() for call in calls]):
            self.app.display_warning("some programs could not be recorded; first calls take longer")
        build_data["force_include"][self.folder.name] = "notchflex/shipped_programs"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the folder that the wheel was made from."""
        if version != "editable":
            self.folder.cleanup()
