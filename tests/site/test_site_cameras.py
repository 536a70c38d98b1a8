"""Cameras of a site file: what is taken, and every mistake as one sentence."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from backend.documents.site import site_document
from backend.errors import InputError
from backend.site.site import Site, load_site, parse_site
from cockpit.cameras import make_cameras, whep_origins
from cockpit.desk import load_models, make_config

FILE = Path(__file__).resolve().parents[2] / "scenes" / "sites" / "demo.toml"
MJPEG = {"kind": "mjpeg", "url": "http://10.0.0.7:8080/stream?topic=/left/front"}
WHEP = {"kind": "whep", "url": "https://media.local:8889/left/whep", "label": "front"}


def site(*cameras: Any, one: Any = None) -> Site:
    data = tomllib.loads(FILE.read_text())
    data["machine"][0]["camera"] = one if one is not None else list(cameras)
    return parse_site(data, FILE)


def test_one_table_or_a_list_of_them() -> None:
    (only,) = site(one=MJPEG).machine("left").camera
    assert (only.kind, only.url, only.label) == ("mjpeg", MJPEG["url"], "")
    both = site(MJPEG, WHEP).machine("left").camera
    assert [camera.kind for camera in both] == ["mjpeg", "whep"]
    assert both[1].origin == "https://media.local:8889"
    assert [camera.name for camera in load_site("demo").machine("right").camera] == ["cab"]


@pytest.mark.parametrize(
    ("camera", "sentence"),
    [
        ({"kind": "rtsp", "url": "http://a/b"}, 'machine[1].camera[1].kind is "rtsp"; allowed is'),
        ({"url": "http://a/b"}, "machine[1].camera[1].kind is missing; it is required."),
        ({"kind": "mjpeg"}, 'kind is "mjpeg"; allowed is that with "url", and without "name".'),
        ({"kind": "link", "url": "http://a/b"}, 'allowed is that with "name", and without "url".'),
        ({**MJPEG, "url": "rtsp://a/b"}, "camera[1].url: is not an address; allowed is http://"),
        ({**MJPEG, "url": "http:///b"}, "is not an address"),
        ({**MJPEG, "url": "http://a:x/b"}, "is not an address"),
        ({**WHEP, "url": "http://a b/c"}, "is not an address"),
        ({**WHEP, "url": "http://a/b; script-src *"}, "is not an address"),
        ({**MJPEG, "port": 80}, "camera[1].port is not a known field; allowed are kind, url"),
        ({**MJPEG, "label": "x" * 17}, "allowed is at most 16 characters"),
    ],
)
def test_mistakes_are_one_sentence(camera: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        site(camera)
    text = str(caught.value)
    assert sentence in text
    assert "\n" not in text


def test_credentials_are_refused_and_not_repeated() -> None:
    with pytest.raises(InputError, match="allowed is an address without them") as caught:
        site({**MJPEG, "url": "http://anna:secret7@10.0.0.7/stream"})
    assert "secret7" not in str(caught.value)
    with pytest.raises(InputError, match="at most 4"):
        site(*[MJPEG] * 5)


def test_pages_learn_addresses_only_where_they_go_themselves() -> None:
    found = site(MJPEG, WHEP, {"kind": "link", "name": "cab"})
    models = load_models(found)
    document = site_document(found, make_config(found, models, (), "LIVE"))
    assert document["machines"]["left"]["cameras"] == [
        {"kind": "mjpeg", "label": "", "url": None},
        {"kind": "whep", "label": "front", "url": WHEP["url"]},
        {"kind": "link", "label": "", "url": None},
    ]
    assert "10.0.0.7" not in str(document)
    played = site_document(found, make_config(found, models, (), "PLAYBACK"))
    assert played["machines"]["left"]["cameras"] == []
    assert set(make_cameras(found, None)) == {"left/0", "left/2", "right/0"}
    assert whep_origins(found) == ("https://media.local:8889",)
