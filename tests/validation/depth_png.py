"""16-bit grey PNG, as depth images are."""
import struct
import zlib

import numpy

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def read(path):
    """Counts, rows x columns."""
    data, at, packed = path.read_bytes(), len(SIGNATURE), b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
            if (depth, colour) != (16, 0):
                raise ValueError(f"{path}: expected a 16-bit grey image")
        elif kind == b"IDAT":
            packed += body
        at += 12 + size
    lines = numpy.frombuffer(zlib.decompress(packed), numpy.uint8).reshape(height, 1 + 2 * width)
    pixels = numpy.zeros((height, 2 * width), numpy.uint8)
    for row, line in enumerate(lines):
        pixels[row] = unfiltered(line[0], line[1:], pixels[row - 1] if row else numpy.zeros(2 * width, numpy.uint8))
    return pixels.view(">u2").astype(numpy.uint16)


def unfiltered(kind, line, above):
    """PNG (ISO/IEC 15948), section 9; two bytes a pixel."""
    if kind == 0:
        return line
    if kind == 2:
        return line + above
    out = line.astype(int)
    up = above.astype(int)
    for i in range(out.size):
        left = out[i - 2] if i >= 2 else 0
        corner = up[i - 2] if i >= 2 else 0
        guess = left + up[i] - corner
        nearest = min((left, up[i], corner), key=lambda value: abs(guess - value))
        out[i] = (out[i] + {1: left, 3: (left + up[i]) // 2, 4: nearest}[kind]) % 256
    return out.astype(numpy.uint8)


def write(path, counts):
    height, width = counts.shape
    lines = numpy.zeros((height, 1 + 2 * width), numpy.uint8)
    lines[:, 1:] = counts.astype(">u2").view(numpy.uint8).reshape(height, 2 * width)

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    path.write_bytes(SIGNATURE + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(lines.tobytes())) + chunk(b"IEND", b""))
