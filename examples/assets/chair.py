#!/usr/bin/env python3
"""A chair as one surface of triangles: seat, back and four legs, boxes that reach into each other. Prints it as OBJ [m].

  examples/assets/chair.py > examples/assets/chair.obj
"""
import math

SIDE, HEIGHT, THICK, LEG = 0.42, 0.45, 0.04, 0.04  # of the seat, and across a leg
BACK_HEIGHT, BACK_THICK, LEAN = 0.48, 0.04, math.radians(8)
REACH = 0.02  # of one box into the next


def box(low, high):
    """The corners of a box."""
    return [(x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])]


def leaned(corners, foot):
    """Turned about a line along x through `foot`, (y, z), back at the top."""
    c, s = math.cos(LEAN), math.sin(LEAN)
    return [(x, foot[0] + c * (y - foot[0]) + s * (z - foot[1]), foot[1] - s * (y - foot[0]) + c * (z - foot[1]))
            for x, y, z in corners]


def parts():
    half, top = SIDE / 2, HEIGHT
    yield box((-half, -half, top - THICK), (half, half, top))
    foot = (half - BACK_THICK, top - REACH)
    yield leaned(box((-half + 0.01, foot[0], foot[1]), (half - 0.01, foot[0] + BACK_THICK, foot[1] + BACK_HEIGHT)), foot)
    inset = 0.01
    for x in (-half + inset, half - inset - LEG):
        for y in (-half + inset, half - inset - LEG):
            yield box((x, y, 0.0), (x + LEG, y + LEG, top - THICK + REACH))


# Two triangles a face, counter-clockwise seen from outside; corner 1 + x + 2 y + 4 z.
FACES = ((1, 3, 4), (1, 4, 2), (5, 6, 8), (5, 8, 7), (1, 2, 6), (1, 6, 5), (3, 7, 8), (3, 8, 4), (1, 5, 7), (1, 7, 3),
         (2, 4, 8), (2, 8, 6))

if __name__ == "__main__":
    vertices, faces = [], []
    for corners in parts():
        faces += [tuple(k + len(vertices) for k in face) for face in FACES]
        vertices += corners
    print("# A chair [m], by examples/assets/chair.py")
    for vertex in vertices:
        print("v %.6f %.6f %.6f" % vertex)
    for face in faces:
        print("f %d %d %d" % face)
