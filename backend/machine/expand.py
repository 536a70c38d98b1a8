"""A robot file's text as plain URDF: xacro expanded in process, packages found without ROS."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from backend.errors import InputError

_XACRO_STATE = threading.Lock()  # the xacro package keeps its state in module globals
_PARENTS = 6


def urdf_text(path: Path) -> str:
    """The URDF in `path`; .xacro files, and files that use xacro, are expanded first."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: not a text file; a URDF or xacro file is needed.") from None
    if path.suffix != ".xacro" and "xmlns:xacro" not in text:
        return text
    return _expand(path)


def _expand(path: Path) -> str:
    import xacro

    def find(package: str) -> str:
        folder = find_package(package, path.parent)
        if folder is None:
            raise InputError(
                f"{path}: package '{package}' in $(find {package}) was not found beside the file "
                f"or above it."
            )
        return str(folder)

    with _XACRO_STATE, _Patched(find):
        try:
            return str(xacro.process_file(str(path)).toxml())
        except InputError:
            raise
        # xacro raises its own types, expat's, and whatever an expression in the file raises.
        except Exception as error:
            cause: BaseException = error
            while isinstance(cause.__cause__, InputError):
                cause = cause.__cause__
            if isinstance(cause, InputError):
                raise cause from None
            words = " ".join(str(error).split()) or type(error).__name__
            raise InputError(f"{path}: xacro cannot expand it: {words}.") from None


class _Patched:
    """xacro asks ROS's index for $(find package); while inside, it asks `find`."""

    def __init__(self, find: Callable[[str], str]) -> None:
        import xacro.substitution_args as substitution

        self.find = find
        self.substitution: Any = substitution
        self.saved: Any = None

    def __enter__(self) -> None:
        self.saved = self.substitution._eval_find
        self.substitution._eval_find = self.find
        self.substitution._eval_dict["find"] = self.find

    def __exit__(self, *_: object) -> None:
        self.substitution._eval_find = self.saved
        self.substitution._eval_dict["find"] = self.saved


def find_package(package: str, folder: Path) -> Path | None:
    """The folder of a ROS package as seen from `folder`: itself, a sibling, or above.

    A folder counts when it bears the package's name; one that does not still counts when it is the
    description's own (it holds meshes, or package.xml names the package).
    """
    for base in [folder, *list(folder.parents)[:_PARENTS]]:
        if base.name == package:
            return base
        if (base / package).is_dir():
            return base / package
        manifest = base / "package.xml"
        if manifest.is_file() and f"<name>{package}</name>" in manifest.read_text(
            "utf-8", "replace"
        ):
            return base
    for base in [folder, *list(folder.parents)[:2]]:
        if (base / "meshes").is_dir() or (base / "urdf").is_dir():
            return base
    return None


def find_mesh(uri: str, folder: Path, file: str) -> Path:
    """The file of a mesh URI (package://, model://, file:// or a path relative to `folder`).

    package://NAME/rest is looked for below a folder called NAME, then as `rest` beside the file
    and above it. Raises InputError when it is nowhere.
    """
    tried: list[Path] = []
    scheme, _, rest = uri.partition("://")
    if not rest:
        tried.append(folder / uri)
    elif scheme == "file":
        tried += [Path(rest), folder / rest.lstrip("/")]
    elif scheme in ("package", "model"):
        package, _, inside = rest.partition("/")
        for base in [folder, *list(folder.parents)[:_PARENTS]]:
            tried += [base / package / inside, base / inside]
            if base.name == package:
                tried.insert(0, base / inside)
    else:
        raise InputError(
            f"{file}: mesh '{uri}': '{scheme}://' is not known; allowed are package://, model://, "
            f"file:// and paths relative to the file."
        )
    for candidate in tried:
        if candidate.is_file():
            return candidate
    raise InputError(
        f"{file}: mesh '{uri}' was not found; looked for {tried[0]} and as a path beside the file "
        f"and above it."
    )
