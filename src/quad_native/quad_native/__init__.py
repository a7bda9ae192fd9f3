"""Machine code of a pure function, behind that function's own signature.

``step = native(step) or step``: where a library was built for exactly this text, it runs in place of CPython, to the
same bits; where there is none, nothing changes. A library needs neither Numba nor a compiler to run.
"""

from quad_native.loading import NativeError, library_path, native
from quad_native.signature import Signature, signature_of

__all__ = ["NativeError", "Signature", "library_path", "native", "signature_of"]
