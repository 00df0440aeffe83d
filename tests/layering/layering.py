"""Checks that no layer of the source tree is crossed.

Usage: layering.py ROOT. Prints one line a violation, `FILE:LINE: what`, and exits 1 if there is any.
"""

import pathlib
import re
import sys

# An outside library, and the only folders that may include it.
OUTSIDE = {
    "Fast DDS": (r"<(fastdds|fastrtps|fastcdr)/", ["services/lib/bus"]),
    "gRPC or protobuf": (r"[<\"](grpc|grpcpp|google/protobuf|exemplar/v1)/", ["services/lib/rpc"]),
    "FCL": (r"<fcl/", ["services/lib/collision"]),
    "OpenCV": (r"<opencv2?/", ["services/lib/perception"]),
    "urdfdom": (r"<urdf(_parser|_model|_world|_exception)?/", ["services/lib/kinematics"]),
    "MuJoCo": (r"<mujoco/", ["services/simulator"]),
    "SQLite": (r"<sqlite3", ["services/learning"]),
    "CLI11": (r"<CLI/", ["services/lib/program", "clients/cli"]),
    "OpenSSL": (r"<openssl/", ["services/lib/security", "services/lib/http"]),
    "spdlog": (r"<spdlog/", ["services/lib/program"]),
    "Boost": (r"<boost/", ["services/lib/http"]),
}

# What each library may include of the others (beside itself): the direction of dependence.
LIBRARIES = {
    "base": [],
    "geometry": ["base"],
    "demonstration": ["base", "geometry"],
    "signal": ["base"],
    "learning": ["base", "geometry", "demonstration", "signal"],
    "kinematics": ["base", "geometry", "demonstration"],
    "scene": ["base", "geometry", "kinematics"],
    "collision": ["base", "geometry", "kinematics", "scene"],
    "motion": ["base", "geometry", "demonstration", "kinematics", "scene", "collision"],
    "reaching": ["base", "geometry", "demonstration", "kinematics"],
    "perception": ["base", "geometry", "scene"],
    "recording": ["base"],
    "ircp": ["base", "geometry", "demonstration"],
    "diagnosis": ["base", "ircp"],
    "joining": ["base", "ircp", "recording"],
    "replay": ["base", "ircp", "recording"],
    "dynamic_data": ["base"],
    "ros2": ["base", "geometry", "ircp", "kinematics"],
    "api": ["base", "geometry", "demonstration", "learning"],
    "figures": ["base", "geometry", "learning"],
    "http": ["base"],
    "security": ["base"],
    "program": ["base", "security", "bus"],
    "bus": ["base", "geometry", "demonstration", "ircp", "recording", "security"],
    "backup": ["base", "api", "security"],
    "rpc": ["base", "geometry", "demonstration", "learning", "api", "security"],
}

PROGRAMS = ["capture_suit", "capture_tactile", "capture_vision", "recorder", "learning", "executor", "simulator", "reference_driver"]

INCLUDE = re.compile(r"^\s*#\s*include\s*([<\"][^>\"]+[>\"])")


def library_of(path):
    parts = path.split("/")
    return parts[2] if parts[:2] == ["services", "lib"] and len(parts) > 3 else None


def program_of(path):
    parts = path.split("/")
    return parts[1] if parts[0] == "services" and len(parts) > 2 and parts[1] in PROGRAMS else None


def violations_of(path, include):
    """Sentences on what is wrong with `include` (with its quotes) in the file at `path`."""
    for name, (pattern, homes) in OUTSIDE.items():
        if re.match(pattern, include) and not any(path.startswith(home + "/") for home in homes):
            yield f"{name} may be included only in {', '.join(homes)}"
    own = re.match(r"[<\"]exemplar/([a-z_]+)/", include)
    library = library_of(path)
    if library is not None:
        if library not in LIBRARIES:
            yield f"library {library} is not in tests/layering/layering.py"
            return
        if own and own[1] != "v1" and own[1] != library and own[1] not in LIBRARIES[library]:
            yield f"{library} may not depend on {own[1]}"
        if re.match(rf"\"({'|'.join(PROGRAMS)})/", include):
            yield "a library knows no program"
    program = program_of(path)
    if program is not None and not path.endswith("/main.cpp"):
        if own and own[1] in ("bus", "rpc"):
            yield f"only main.cpp of a program may include {own[1]}: behaviour knows ports"
        other = re.match(rf"\"({'|'.join(PROGRAMS)})/", include)
        if other and other[1] != program:
            yield f"{program} may not include {other[1]}: programs meet on the network"


def check(root):
    root = pathlib.Path(root)
    found = []
    for top in ("services", "clients", "gateway"):
        for file in sorted((root / top).rglob("*")):
            if file.suffix not in (".hpp", ".cpp", ".h", ".cc"):
                continue
            path = file.relative_to(root).as_posix()
            for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1):
                match = INCLUDE.match(line)
                if match:
                    found += [f"{path}:{number}: {what} ({match[1]})" for what in violations_of(path, match[1])]
    return found


if __name__ == "__main__":
    lines = check(sys.argv[1])
    print("\n".join(lines) if lines else "no layer is crossed")
    sys.exit(1 if lines else 0)
