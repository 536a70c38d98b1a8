"""The ROS 2 types in use: Humble's, and the cockpit's own.

Importing this takes a quarter of a second, so only what reads or writes messages does.
"""

from __future__ import annotations

from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from backend.shell.link.messages import DEFINITIONS


def _typestore() -> Any:
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in DEFINITIONS.items():
        store.register(get_types_from_msg(text, name))
    return store


TYPESTORE: Any = _typestore()
