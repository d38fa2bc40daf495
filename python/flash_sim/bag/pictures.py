"""Pictures and depth out of the messages that carry them."""
import io
import struct
from dataclasses import dataclass

import numpy as np

from flash_sim.bag import png
from flash_sim.bag.errors import RecordingError, refusal

COLOURS = {"rgb8": (3, [0, 1, 2]), "bgr8": (3, [2, 1, 0]), "rgba8": (4, [0, 1, 2]), "bgra8": (4, [2, 1, 0]), "8UC3": (3, [2, 1, 0])}
GREYS = ("mono8", "8UC1")
# Where the first red pixel stands, row and column.
BAYER = {"bayer_rggb8": (0, 0), "bayer_grbg8": (0, 1), "bayer_gbrg8": (1, 0), "bayer_bggr8": (1, 1)}
COUNTS, METRES = ("16UC1", "mono16", "z16"), "32FC1"
OTHERS = ("rgb", "color", "colour", "infra", "confidence")  # what else a camera of depth sends
PNG, JPEG = b"\x89PNG", b"\xff\xd8\xff"
DEPTH_HEADER = 12  # bytes before the PNG of compressedDepth: a number, then two parameters of inverse depth


@dataclass(frozen=True)
class Picture:
    """A picture of eight bits, in the file that shows it."""

    stamp: int     # of the header [ns]
    frame: str     # of the camera
    width: int     # [px]
    height: int
    encoding: str  # of the message, for people to read
    ending: str    # of the file: png, or jpg where the camera compressed it so
    file: bytes


@dataclass(frozen=True)
class DepthPicture:
    """Depth along the optical axis: counts (h, w) uint16, 0 where nothing was measured, or metres (h, w) float32 or float64, not a
    number where nothing was measured."""

    stamp: int
    frame: str
    encoding: str
    pixels: np.ndarray

    @property
    def counts(self):
        """Whether pixels are counts."""
        return self.pixels.dtype == np.uint16


def stamp_of(message):
    """Of the header [ns]."""
    stamp = message.header.stamp
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def frame_of(message):
    """Of the header, without the slash of older files."""
    return str(message.header.frame_id).lstrip("/")


def encoding_of(message):
    """The encoding of an Image; of a CompressedImage its format and, where it has none, what its bytes are."""
    if hasattr(message, "encoding"):
        return str(message.encoding)
    return str(message.format) or ("png" if bytes(message.data[:4]) == PNG else "jpeg")


def is_depth(message, topic):
    """Whether a message is of depth, by its encoding; 16-bit grey and whatever has eight bits by the name of its topic."""
    encoding = encoding_of(message)
    if "compressedDepth" in encoding or encoding.split(";")[0] in ("16UC1", METRES, "z16"):
        return True
    parts = topic.lower().split("/")
    named = any("depth" in part for part in parts) or "sensor_3" in parts
    return named and not any(word in part for part in parts if "depth" not in part for word in OTHERS)


def picture_of(message, where):
    """The Picture of an Image or a CompressedImage. Throws RecordingError, which begins with `where`."""
    if not hasattr(message, "encoding"):
        return _compressed(message, where)
    encoding = str(message.encoding)
    if encoding in COLOURS:
        channels, order = COLOURS[encoding]
        pixels = _rows(message, np.uint8, channels, where)[:, :, order]
    elif encoding in GREYS:
        pixels = _rows(message, np.uint8, 1, where)[:, :, 0]
    elif encoding in BAYER:
        pixels = demosaiced(_rows(message, np.uint8, 1, where)[:, :, 0], *BAYER[encoding])
    else:
        raise refusal(where, f"found a picture of encoding {encoding}, expected {', '.join([*COLOURS, *GREYS, *BAYER])}")
    return Picture(stamp_of(message), frame_of(message), int(message.width), int(message.height), encoding, "png",
                   png.encoded(np.ascontiguousarray(pixels)))


def depth_of(message, where):
    """The DepthPicture of an Image or a CompressedImage. Throws RecordingError: eight bits, RVL, inverse depth without its
    parameters, or a picture that is cut off."""
    if not hasattr(message, "encoding"):
        pixels = _compressed_depth(message, where)
    elif message.encoding in COUNTS:
        pixels = _rows(message, np.uint16, 1, where)[:, :, 0]
    elif message.encoding == METRES:
        pixels = _rows(message, np.float32, 1, where)[:, :, 0]
    else:
        raise _not_depth(message.encoding, where)
    return DepthPicture(stamp_of(message), frame_of(message), encoding_of(message), pixels)


def demosaiced(mosaic, row, column):
    """Red, green, blue (h, w, 3) of a Bayer mosaic (h, w), the first red pixel at `row`, `column`: what was measured stays, the
    rest is the mean of the nearest pixels of that colour."""
    y, x = np.indices(mosaic.shape)
    red, blue = (y % 2 == row) & (x % 2 == column), (y % 2 != row) & (x % 2 != column)
    planes = []
    for measured in (red, ~(red | blue), blue):
        values = _smoothed(np.where(measured, mosaic, 0).astype(np.float64)) / _smoothed(measured.astype(np.float64))
        planes.append(np.where(measured, mosaic, np.rint(values)).astype(np.uint8))
    return np.stack(planes, axis=2)


def _smoothed(values):
    """By 1 2 1 along rows and columns, nothing beyond the edge."""
    for axis in (0, 1):
        padded = np.pad(values, [(1, 1) if k == axis else (0, 0) for k in (0, 1)])
        first, last = np.delete(padded, [-1, -2], axis), np.delete(padded, [0, 1], axis)
        values = first + 2 * values + last
    return values


def _rows(message, kind, channels, where):
    """Pixels (h, w, channels) of an Image, whose rows may have bytes behind them."""
    kind = np.dtype(kind)
    height, width, step = int(message.height), int(message.width), int(message.step)
    size = width * channels * kind.itemsize
    if height < 1 or width < 1 or step < size or len(message.data) < step * height:
        raise refusal(where, f"found {len(message.data)} bytes in rows of {step} for a picture of {width} x {height} "
                             f"{message.encoding}, expected {size * height}")
    rows = np.frombuffer(bytes(message.data[:step * height]), np.uint8).reshape(height, step)[:, :size]
    order = ">" if message.is_bigendian else "<"
    pixels = np.ascontiguousarray(rows).view(kind.newbyteorder(order)).astype(kind)
    return pixels.reshape(height, width, channels)


def _opened(data, where):
    """The picture in the bytes of a file, whole."""
    try:
        from PIL import Image
    except ImportError as error:
        raise RecordingError(f"{where}: found compressed pictures and no package Pillow, which reads them: "
                             "pip install 'flash-sim[bag]'") from error
    try:
        picture = Image.open(io.BytesIO(data), formats=("PNG", "JPEG"))
        picture.load()
    except Exception as error:  # of many types, by the way in which bytes are wrong
        line = " ".join(str(error).split())[:100]
        raise refusal(where, f"found a compressed picture of {len(data)} bytes that cannot be read ({line}), expected PNG or JPEG"
                      ) from error
    return picture


def _compressed(message, where):
    data = bytes(message.data)
    picture = _opened(data, where)
    if picture.mode not in ("L", "RGB", "RGBA", "P", "1"):
        raise refusal(where, f"found a compressed picture of mode {picture.mode}, expected eight bits of grey or colour")
    ending = "png" if data[:4] == PNG else "jpg"
    return Picture(stamp_of(message), frame_of(message), *picture.size, encoding_of(message), ending, data)


def _compressed_depth(message, where):
    """Counts or metres of compressedDepth, or of a PNG of 16 bits."""
    data, encoding = bytes(message.data), encoding_of(message)
    kind = encoding.split(";")[0].strip()
    if "rvl" in encoding.lower():
        raise refusal(where, f"found depth compressed as RVL ({encoding}), expected PNG: set the parameter format of "
                             "compressed_depth_image_transport to png, or record the depth as it is")
    wrapped = "compressedDepth" in encoding or data[DEPTH_HEADER:DEPTH_HEADER + 4] == PNG
    body = data[DEPTH_HEADER:] if wrapped else data
    if body[:4] != PNG:
        raise _not_depth(encoding if body[:3] == JPEG else f"{encoding} that is no PNG", where)
    picture = _opened(body, where)
    if not picture.mode.startswith("I"):
        raise _not_depth(f"{encoding} of mode {picture.mode}", where)
    counts = np.array(picture).astype(np.uint16)
    if not wrapped or kind != METRES:
        return counts
    _, a, b = struct.unpack("<iff", data[:DEPTH_HEADER])
    if a == 0 or not np.isfinite([a, b]).all():
        raise refusal(where, f"found inverse depth with the parameters {a:g} and {b:g}, expected those that it was made with: "
                             "record the depth as it is")
    with np.errstate(divide="ignore"):
        return np.where(counts > 0, a / (counts.astype(np.float64) - b), np.nan)


def _not_depth(encoding, where):
    return refusal(where, f"found depth as {encoding}, expected 16UC1, 32FC1 or compressedDepth: eight bits or JPEG have lost it")
