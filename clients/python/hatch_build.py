"""Compiles proto/ into the descriptors that the package carries, while pip builds it.

Descriptors rather than generated Python: generated code only runs with a protobuf at least as new as the
compiler that wrote it, descriptors with any. The compiler is that of grpcio-tools, or a protoc on the PATH.
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

NAME = "api.binpb"


class DescriptorHook(BuildHookInterface):
    """Puts `exemplar/api.binpb` into the wheel; into src/ for an editable one."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called by hatchling before it builds."""
        if self.target_name != "wheel":
            return
        package = pathlib.Path(self.root) / "src" / "exemplar"
        if version == "editable":
            compile_protos(self._protos(), package / NAME)
            return
        self._folder = tempfile.TemporaryDirectory()
        made = pathlib.Path(self._folder.name) / NAME
        compile_protos(self._protos(), made)
        build_data["force_include"][str(made)] = f"exemplar/{NAME}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Called by hatchling afterwards."""
        if hasattr(self, "_folder"):
            self._folder.cleanup()

    def _protos(self) -> pathlib.Path:
        """Beside the sources in a source distribution, at the checkout's top else."""
        root = pathlib.Path(self.root)
        for folder in (root / "proto", root.parents[1] / "proto"):
            if (folder / "exemplar" / "v1").is_dir():
                return folder
        raise RuntimeError(f"no proto/exemplar/v1 in {root} and {root.parents[1]}")


def compile_protos(protos: pathlib.Path, output: pathlib.Path) -> None:
    """Writes the descriptors of all of `protos`, with what they import."""
    files = sorted(str(file.relative_to(protos)) for file in protos.rglob("*.proto"))
    try:
        import grpc_tools

        included = pathlib.Path(grpc_tools.__file__).parent / "_proto"
        compiler = [sys.executable, "-m", "grpc_tools.protoc", f"-I{included}"]
    except ImportError:
        if not shutil.which("protoc"):
            raise RuntimeError("neither the package grpcio-tools nor a protoc on the PATH") from None
        compiler = ["protoc"]
    options = [f"-I{protos}", "--include_imports", f"--descriptor_set_out={output}"]
    subprocess.run([*compiler, *options, *files], check=True)
