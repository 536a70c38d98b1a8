"""Binary frames survive the round trip."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from backend.shell.app.wire import decode, dumps, encode

numbers = hnp.arrays(
    st.sampled_from([np.float32, np.float64, np.uint8, np.int32]),
    hnp.array_shapes(min_dims=1, max_dims=3, min_side=0, max_side=5),
)


@given(st.dictionaries(st.text(min_size=1, max_size=8), numbers, max_size=4), st.text(max_size=30))
def test_round_trip(arrays: dict[str, np.ndarray], note: str) -> None:
    header, back = decode(encode({"type": "test", "note": note}, arrays))
    assert header == {"type": "test", "note": note}
    assert back.keys() == arrays.keys()
    for name, array in arrays.items():
        np.testing.assert_array_equal(back[name], array)


def test_payload_is_aligned_for_typed_arrays() -> None:
    frame = encode({"type": "x"}, {"a": np.ones(3, np.uint8), "b": np.ones(2)})
    header, _ = decode(frame)
    assert header == {"type": "x"}
    length = int.from_bytes(frame[:4], "little")
    assert b'"offset":8' in frame[4 : 4 + length]


def test_what_is_not_a_number_becomes_null() -> None:
    assert (
        dumps({"d": float("nan"), "t": [float("inf"), np.float64(1.5)]})
        == '{"d":null,"t":[null,1.5]}'
    )


def test_unknown_dtype_is_refused() -> None:
    with pytest.raises(TypeError, match="complex"):
        encode({}, {"z": np.ones(1, complex)})
