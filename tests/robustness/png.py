"""PNG pictures of eight bits a channel, without a library."""
import struct
import zlib


def read(path):
    """Width, height, channels, and rows of bytes."""
    data, place, packed = path.read_bytes(), 8, b""
    while place < len(data):
        length, kind = struct.unpack(">I4s", data[place:place + 8])
        body = data[place + 8:place + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
            channels = {0: 1, 2: 3, 4: 2, 6: 4}[colour]
            if depth != 8:
                raise ValueError(f"{path}: {depth} bits a channel, expected 8")
        packed += body if kind == b"IDAT" else b""
        place += 12 + length
    plain, stride = zlib.decompress(packed), width * channels
    rows, above = [], bytearray(stride)
    for y in range(height):
        kind, row = plain[y * (stride + 1)], bytearray(plain[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for x in range(stride) if kind else ():
            a, b = row[x - channels] if x >= channels else 0, above[x]
            c = above[x - channels] if x >= channels else 0
            nearest = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
            row[x] = (row[x] + (0, a, b, (a + b) // 2, nearest)[kind]) & 255
        rows.append(row)
        above = row
    return width, height, channels, rows


def write(path, width, height, channels, rows):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    colour = {1: 0, 2: 4, 3: 2, 4: 6}[channels]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, colour, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 1)) + chunk(b"IEND", b""))


def turned(width, height, channels, rows):
    """By half a turn."""
    return width, height, channels, [
        b"".join(row[x:x + channels] for x in range((width - 1) * channels, -1, -channels)) for row in reversed(rows)]


def halved(width, height, channels, rows):
    """Of half the size: every second pixel."""
    return width // 2, height // 2, channels, [
        b"".join(row[x:x + channels] for x in range(0, width // 2 * 2 * channels, 2 * channels))
        for row in rows[:height // 2 * 2:2]]
