"""The live view, in a browser or in a notebook's cell."""

from __future__ import annotations

import atexit
import html
import weakref
from collections.abc import Sequence
from typing import Any

from . import _slicestack
from ._render import _opened

# Where notebooks usually are; others are named by whoever has them there.
_NOTEBOOKS = ("http://localhost:*", "http://127.0.0.1:*", "vscode-webview:")


class View:
    """A live view: it can be turned, and shows the same pictures as :func:`render`. It ends with :meth:`stop`, or when it is let go.

    The server listens on this machine alone, and its address holds a token: whoever has the address can see the volume.
    """

    def __init__(self, native: Any, height: int) -> None:
        self._native = native
        self.height = height
        self._end = weakref.finalize(self, native.stop)
        # Finalizers of the interpreter's end come too late for threads.
        atexit.register(self._end)

    @property
    def url(self) -> str:
        """Its address, for a browser of this machine."""
        return self._native.url

    @property
    def port(self) -> int:
        """The port that it listens at, on the loopback."""
        return self._native.port

    def stop(self) -> None:
        """Ends it."""
        self._end()
        atexit.unregister(self._end)

    def _repr_html_(self) -> str:
        if not self._end.alive:
            return "<em>this view has ended</em>"
        url = html.escape(self.url, quote=True)
        return f'<iframe src="{url}" width="100%" height="{self.height}" style="border:0" allow="fullscreen"></iframe>'

    def __repr__(self) -> str:
        return f"<slicestack.View at {self.url}>" if self._end.alive else "<slicestack.View, ended>"


def view(
    volume: Any = None,
    scene: Any = None,
    *,
    port: int = 0,
    threads: int | None = None,
    height: int = 640,
    origins: Sequence[str] = _NOTEBOOKS,
    **keys: Any,
) -> View:
    """Shows a volume live, to be turned: the last value of a notebook's cell, or ``.url`` in a browser.

    Parameters
    ----------
    volume, scene, keys
        As in :func:`render`.
    port
        To listen at, on this machine alone; a free one unless given.
    height
        Of the notebook's frame, pixels.
    origins
        Pages that may hold the view in a frame: those of notebooks on this machine unless given.
    """
    opened, resolved = _opened(volume, scene, keys, None)
    native = _slicestack.View(
        resolved._file, opened._native, port=port, threads=threads, ancestors=list(origins), title=opened.name or "array"
    )
    return View(native, height)
