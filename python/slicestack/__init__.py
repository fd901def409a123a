"""Volume rendering by texture slicing on the CPU alone: no GPU, no display, the same bytes on every machine.

>>> import slicestack
>>> image = slicestack.render("head.nrrd", preset="mr-brain", azimuth=30)   # doctest: +SKIP
>>> image.save("head.png")                                                  # doctest: +SKIP

Arrays are indexed (z, y, x), as NumPy, scikit-image and SimpleITK have them; lengths such as ``spacing`` and ``origin`` are told
along x, y, z, in world units (millimetres for medical data). Pictures are those of the command ``slicestack``, byte for byte.
"""

from ._arrays import CopyWarning, Volume
from ._picture import Image
from ._render import Renderer, render, turntable
from ._scene import Scene, presets, schema
from ._slicestack import __version__
from ._view import View, view

__all__ = [
    "CopyWarning",
    "Image",
    "Renderer",
    "Scene",
    "View",
    "Volume",
    "__version__",
    "presets",
    "render",
    "schema",
    "turntable",
    "view",
]
