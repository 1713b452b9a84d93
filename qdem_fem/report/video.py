"""The pictures of a run, one behind the other, as an animated GIF: any browser shows it."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

from trackbed.run_files import write_whole


def write_video(path: Path, pictures: Sequence[Path], rate: float) -> None:
    """Write ``path`` from PNG ``pictures``, ``rate`` of them a second [1/s], again and again.

    Each keeps its scale, at the lower left of a frame that holds the largest of them.  GIF counts
    hundredths of a second and has 256 colours a frame: for more, take the PNG files.
    """
    from PIL import Image

    seen = [Image.open(picture).convert("RGB") for picture in pictures]
    wide, high = (max(one.size[k] for one in seen) for k in range(2))
    frames = []
    for one in seen:
        frame = Image.new("RGB", (wide, high), "white")
        frame.paste(one, (0, high - one.size[1]))
        frames.append(frame.quantize())
    whole = BytesIO()
    frames[0].save(
        whole, "GIF", save_all=True, append_images=frames[1:], duration=1000 / rate, loop=0
    )
    write_whole(path, whole.getvalue())
