"""Work that threads share: each takes the next piece when it is ready for one."""

from __future__ import annotations

from typing import Any

from numba import types
from numba.extending import intrinsic


@intrinsic  # type: ignore[untyped-decorator]
def taken(_typing: Any, counter: Any) -> Any:
    """The value of counter (1,), int64, which is one more for the next who asks; in compiled code.
    No two threads get the same.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        one = context.get_constant(types.int64, 1)
        return builder.atomic_rmw("add", array.data, one, "monotonic")

    return types.int64(counter), generate
