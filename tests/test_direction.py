"""The direction rule: which room may import which, and which libraries stay in their room."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

ROOMS: dict[str, set[str]] = {
    "backend.errors": set(),
    "backend.spatial": {"backend.errors"},
    "backend.machine": {"backend.spatial", "backend.errors"},
    "backend.collision": {"backend.machine", "backend.spatial", "backend.errors"},
    "backend.fusion": {"backend.machine", "backend.spatial", "backend.errors"},
    "backend.gauge": {
        *("backend.collision", "backend.machine", "backend.spatial", "backend.errors"),
    },
    "backend.site": {
        *("backend.gauge", "backend.fusion", "backend.machine", "backend.spatial"),
        "backend.errors",
    },
    "backend.cspace": {
        "backend.collision",
        "backend.machine",
        "backend.spatial",
        "backend.fusion",
    },
    "backend.safety": {"backend.collision", "backend.machine", "backend.spatial"},
    "backend.stability": {"backend.machine", "backend.spatial", "backend.errors"},
    "backend.planning": {
        *("backend.safety", "backend.collision", "backend.machine", "backend.spatial"),
        *("backend.stability", "backend.errors"),
    },
    "backend.contact": {
        *("backend.stability", "backend.machine", "backend.spatial", "backend.errors"),
    },
    "backend.surmount": {
        *("backend.contact", "backend.planning", "backend.stability", "backend.machine"),
        *("backend.spatial", "backend.errors"),
    },
    "backend.perception": {"backend.spatial", "backend.errors"},
    "backend.tracking": {"backend.spatial", "backend.errors"},
    "backend.control": {
        *("backend.safety", "backend.machine", "backend.spatial", "backend.errors"),
    },
    "backend.pipeline": {
        *("backend.safety", "backend.cspace", "backend.collision", "backend.fusion"),
        *("backend.perception", "backend.tracking", "backend.stability"),
        *("backend.site", "backend.machine", "backend.spatial", "backend.errors"),
    },
    "backend.documents": {
        *("backend.pipeline", "backend.planning", "backend.safety", "backend.cspace"),
        *("backend.collision", "backend.stability", "backend.contact", "backend.surmount"),
        *("backend.gauge", "backend.site", "backend.fusion", "backend.machine"),
        *("backend.perception", "backend.tracking", "backend.spatial", "backend.errors"),
    },
    "backend.shell": {"backend"},
    "backend.warm": {
        *("backend.pipeline", "backend.planning", "backend.cspace", "backend.collision"),
        *("backend.machine", "backend.perception", "backend.safety", "backend.site"),
        *("backend.spatial", "backend.stability", "backend.tracking"),
    },
    "cockpit": {"backend", "cockpit"},
}

LIBRARIES: dict[str, str | tuple[str, ...]] = {
    "fcl": "backend.collision",
    "zenoh": "backend.shell.link",
    "cryptography": "backend.shell",
    "rosbags": "backend.shell",
    "mcap": "backend.shell.session",
    "zstandard": "backend.shell.session",
    "can": ("backend.shell.session", "backend.shell.agent"),
    "cantools": ("backend.shell.session", "backend.shell.agent"),
    "lxml": "backend.gauge",
    "ifcopenshell": "backend.gauge",
    "sklearn": "backend.perception",
    "pyarrow": "backend.shell.session",
    "PIL": "backend.shell.sim",
    "fastapi": "backend.shell.app",
    "fastapi_offline": "backend.shell.app",
    "starlette": "backend.shell.app",
    "uvicorn": "backend.shell.app",
    "toppra": "backend.planning.trajectory.timing",
    "mujoco": "backend.contact",
    "casadi": "backend.planning.trajectory.timing",
    "viser": "cockpit.views",
}

IMPURE = {"time", "random", "threading", "logging", "asyncio", "socket", "subprocess", "requests"}
PURE = {
    *("spatial", "collision", "control", "cspace", "fusion", "gauge", "safety", "planning"),
    *("contact", "perception", "pipeline", "stability", "surmount", "tracking"),
}


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(path: Path) -> list[str]:
    names = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names.append(node.module or "")
    return names


def sources() -> list[Path]:
    return [p for folder in ("backend", "cockpit") for p in sorted((ROOT / folder).rglob("*.py"))]


def room_of(module: str) -> str | None:
    found = [room for room in ROOMS if module == room or module.startswith(room + ".")]
    return max(found, key=len) if found else None


def inside(module: str, room: str) -> bool:
    return module == room or module.startswith(room + ".")


@pytest.mark.parametrize("path", sources(), ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_go_one_way(path: Path) -> None:
    module = module_name(path)
    room = room_of(module)
    if module == "backend":
        return
    assert room is not None, f"{module} is in no room; add it to the plan of the house"
    for name in imports_of(path):
        top = name.split(".")[0]
        if top in LIBRARIES:
            home = LIBRARIES[top]
            rooms = (home,) if isinstance(home, str) else home
            assert any(inside(module, r) for r in rooms), f"{module} imports {name}"
        if top in ("backend", "cockpit"):
            allowed = {room, *ROOMS[room]}
            assert any(inside(name, other) for other in allowed), f"{module} imports {name}"


@pytest.mark.parametrize("room", sorted(PURE))
def test_pure_rooms_have_no_clock_and_no_io(room: str) -> None:
    for path in sorted((ROOT / "backend" / room).rglob("*.py")):
        found = {name.split(".")[0] for name in imports_of(path)} & IMPURE
        assert not found, f"{path.relative_to(ROOT)} imports {sorted(found)}"


def test_every_import_is_a_declared_dependency(repository: Path) -> None:
    import tomllib

    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    aliases = {
        "argon2-cffi": "argon2",
        "eclipse-zenoh": "zenoh",
        "pillow": "PIL",
        "python-can": "can",
        "python-fcl": "fcl",
        "pyyaml": "yaml",
        "scikit-learn": "sklearn",
    }
    extras = project["optional-dependencies"]
    names = [*project["dependencies"], *extras["ifc"], *extras["ground"], *extras["planning"]]
    declared = {aliases.get(name, name).replace("-", "_") for name in names}
    for path in sources():
        for name in imports_of(path):
            top = name.split(".")[0]
            known = top in sys.stdlib_module_names or top in ("backend", "cockpit", "starlette")
            assert known or top in declared, f"{path.relative_to(ROOT)} imports {top}"
