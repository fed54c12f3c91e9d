"""The native finder of proofs (kernel/proof): one build for all processors, apart from the kernel's levels."""

from __future__ import annotations

from spacearm.core.checks import shown_error
from spacearm.core.errors import KernelError

try:
    from spacearm._kernel import _proof as native_finder
except ImportError as missing:
    raise KernelError(
        f"the compiled finder of proofs cannot be loaded ({shown_error(missing)}), expected one built for this Python; "
        "install spacearm again"
    ) from None

__all__ = ["native_finder"]
