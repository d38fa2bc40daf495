"""Measures of the meshes and clouds that `flash-sysid replay` keeps. Small meshes, no libraries."""
import math
import struct


def read_ply(path):
    """Vertices and triangles of a PLY file with vertices of x, y, z and, perhaps, faces of three."""
    content = path.read_bytes()
    end = content.index(b"end_header\n") + len(b"end_header\n")
    header = content[:end].decode("ascii").split("\n")
    binary = "format binary_little_endian 1.0" in header
    counts = {line.split()[1]: int(line.split()[2]) for line in header if line.startswith("element ")}
    types = [line.split()[1] for line in header if line.startswith("property ") and " list " not in line]
    if binary:
        code = {"float": "f", "double": "d"}[types[0]]
        record = struct.Struct("<3" + code)
        vertices = [record.unpack_from(content, end + i * record.size) for i in range(counts["vertex"])]
        at = end + counts["vertex"] * record.size
        faces = [struct.unpack_from("<3i", content, at + 13 * i + 1) for i in range(counts.get("face", 0))]
        return vertices, faces
    lines = content[end:].decode("ascii").split("\n")
    vertices = [tuple(map(float, line.split()[:3])) for line in lines[:counts["vertex"]]]
    rows = lines[counts["vertex"]:counts["vertex"] + counts.get("face", 0)]
    return vertices, [tuple(map(int, line.split()[1:4])) for line in rows]


def sub(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def pierces(p, q, a, b, c):
    """Whether the segment p q passes through the triangle a b c (Moller and Trumbore 1997)."""
    direction, ab, ac = sub(q, p), sub(b, a), sub(c, a)
    normal = cross(direction, ac)
    scale = dot(ab, normal)
    if abs(scale) < 1e-18:
        return False
    ap = sub(p, a)
    u = dot(ap, normal) / scale
    if not 0 <= u <= 1:
        return False
    side = cross(ap, ab)
    v = dot(direction, side) / scale
    return v >= 0 and u + v <= 1 and 0 <= dot(ac, side) / scale <= 1


def piercings(vertices, faces):
    """Pairs of an edge and a triangle without a common vertex that pass through each other."""
    edges = {tuple(sorted((face[k], face[k - 1]))) for face in faces for k in range(3)}
    boxes = [tuple((min(x), max(x)) for x in zip(*(vertices[i] for i in face))) for face in faces]
    count = 0
    for i, j in edges:
        p, q = vertices[i], vertices[j]
        low = [min(x) for x in zip(p, q)]
        high = [max(x) for x in zip(p, q)]
        for face, box in zip(faces, boxes):
            if i in face or j in face or any(box[k][0] > high[k] or box[k][1] < low[k] for k in range(3)):
                continue
            count += pierces(p, q, *(vertices[k] for k in face))
    return count


def piercings_by_frame(folder, frames, grasp=0.06):
    """Without the triangles within `grasp` of the grasped corner: a pinch folds the sheet onto itself."""
    found = {}
    rest = rest_positions(folder, frames[-1])
    for frame in frames:
        vertices, faces = read_ply(folder / f"{frame:03d}_mesh.ply")
        clear = [face for face in faces if all(max(rest[i]) > grasp for i in face)]
        found[frame] = piercings(vertices, clear)
    return found


def rest_positions(folder, frame):
    """Of a square sheet that lies flat in frame 0, along its sides from the corner that is highest in `frame`, the grasped one."""
    start = [vertex[:2] for vertex in read_ply(folder / "000_mesh.ply")[0]]
    lifted = [vertex[2] for vertex in read_ply(folder / f"{frame:03d}_mesh.ply")[0]]
    middle = [sum(x) / len(start) for x in zip(*start)]
    first = max(range(len(start)), key=lambda i: math.dist(start[i], middle))
    across = max(range(len(start)), key=lambda i: math.dist(start[i], start[first]))

    def beside(i):
        (x, y), (u, v) = ([a - b for a, b in zip(start[k], start[first])] for k in (i, across))
        return u * y - v * x

    sides = max(range(len(start)), key=beside), min(range(len(start)), key=beside)
    corner = max((first, across, *sides), key=lambda i: lifted[i])
    neighbours = sides if corner in (first, across) else (first, across)
    axes = [[(a - b) / math.dist(start[n], start[corner]) for a, b in zip(start[n], start[corner])] for n in neighbours]
    return [(*(sum(u * (a - b) for u, a, b in zip(axis, place, start[corner])) for axis in axes), 0.0) for place in start]


def nearest_on_triangle(p, a, b, c):
    """Barycentric coordinates of the point of a triangle nearest to p, by projection on face, then edges."""
    ab, ac, ap = sub(b, a), sub(c, a), sub(p, a)
    g00, g01, g11, h0, h1 = dot(ab, ab), dot(ab, ac), dot(ac, ac), dot(ab, ap), dot(ac, ap)
    scale = g00 * g11 - g01 * g01
    v, w = (g11 * h0 - g01 * h1) / scale, (g00 * h1 - g01 * h0) / scale
    if v >= 0 and w >= 0 and v + w <= 1:
        return 1 - v - w, v, w
    candidates = []
    for (i, s), (j, e) in (((0, a), (1, b)), ((1, b), (2, c)), ((2, c), (0, a))):
        edge = sub(e, s)
        t = min(1.0, max(0.0, dot(sub(p, s), edge) / dot(edge, edge)))
        weights = [0.0, 0.0, 0.0]
        weights[i], weights[j] = 1 - t, t
        candidates.append((distance(p, combine(weights, (a, b, c))), tuple(weights)))
    return min(candidates)[1]


def combine(weights, points):
    return tuple(sum(w * point[k] for w, point in zip(weights, points)) for k in range(3))


def distance(a, b):
    return math.dist(a, b)


def residual_by_zone(folder, frames, size=0.278, every=12, trim=0.05):
    """Trimmed mean distance [m] of observed points to the surface in three zones of the sheet, by the material
    distance of the nearest point from the grasped corner: within a third of the diagonal, the next,
    the rest. One point of `every` is measured."""
    zones = [[], [], []]
    rest = rest_positions(folder, frames[-1])
    for frame in frames:
        vertices, faces = read_ply(folder / f"{frame:03d}_mesh.ply")
        cloud, _ = read_ply(folder / f"{frame:03d}_cloud.ply")
        measured = []
        for point in cloud[::every]:
            near = sorted(range(len(vertices)), key=lambda i: distance(point, vertices[i]))[:8]
            best = math.inf, 0.0
            for face in faces:
                if not any(i in face for i in near):
                    continue
                weights = nearest_on_triangle(point, *(vertices[i] for i in face))
                away = distance(point, combine(weights, [vertices[i] for i in face]))
                if away < best[0]:
                    best = away, math.hypot(*combine(weights, [rest[i] for i in face])[:2])
            measured.append(best)
        measured.sort()
        for away, material in measured[:round((1 - trim) * len(measured))]:
            zones[min(2, int(3 * material / (size * math.sqrt(2))))].append(away)
    return [sum(zone) / len(zone) if zone else math.nan for zone in zones]
