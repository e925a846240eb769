"""vastlight: pictures and rays of scenes of any size.

    import vastlight as vl

    scene = vl.load("demo:still-life")
    image = vl.render(scene, size=(640, 360), spp=64)
    image.save("still-life.png")
"""

from ._accumulator import Accumulator, merge
from ._changes import Environment, Light, Material
from ._errors import DeviceError, Error, MemoryBudgetError, OutputError, SceneError, UsageError
from ._image import Image
from ._native import version as _version
from ._progress import Progress
from ._render import CameraView, RenderOptions, View, accumulate, progressive, render, view
from ._scene import Hits, Object, Scene, load

__version__: str = _version()

__all__ = [
    "Accumulator",
    "CameraView",
    "DeviceError",
    "Environment",
    "Error",
    "Hits",
    "Image",
    "Light",
    "Material",
    "MemoryBudgetError",
    "Object",
    "OutputError",
    "Progress",
    "RenderOptions",
    "Scene",
    "SceneError",
    "UsageError",
    "View",
    "__version__",
    "accumulate",
    "load",
    "merge",
    "progressive",
    "render",
    "view",
]
