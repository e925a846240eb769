"""Small JPEG files, and the texels that libjpeg-turbo (through Pillow) makes of them: run with Pillow installed."""

from pathlib import Path
from PIL import Image

HERE = Path(__file__).parent
WIDTH, HEIGHT = 37, 43

KINDS = {
    "444": dict(subsampling="4:4:4"),
    "422": dict(subsampling="4:2:2"),
    "420": dict(subsampling="4:2:0"),
    "420-restart": dict(subsampling="4:2:0", restart_marker_blocks=2),
    "420-progressive": dict(subsampling="4:2:0", progressive=True),
    "grey": dict(),
    "grey-progressive": dict(progressive=True),
    "rgb": dict(keep_rgb=True),
}


def texel(x, y):
    noise = ((x // 2 * 7919 + y // 3 * 104729) * 2654435761 >> 16) & 255
    return noise, 255 * x // WIDTH, 255 * y // HEIGHT


picture = Image.new("RGB", (WIDTH, HEIGHT))
picture.putdata([texel(x, y) for y in range(HEIGHT) for x in range(WIDTH)])
for name, options in KINDS.items():
    source = picture.convert("L") if "grey" in name else picture
    source.save(HERE / f"{name}.jpg", quality=85, **options)
    Image.open(HERE / f"{name}.jpg").save(HERE / f"{name}.png", optimize=True)
