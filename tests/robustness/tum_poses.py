"""Poses as the lines of a TUM file: stamp, x y z, qx qy qz qw."""


def read_poses(path):
    return [[float(word) for word in line.split()] for line in path.read_text().splitlines() if line[:1] not in "#"]


def write_poses(path, poses):
    path.write_text("".join(" ".join(f"{value:.12g}" for value in pose) + "\n" for pose in poses))


def multiply(a, b):
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz]


def conjugate(q):
    return [-q[0], -q[1], -q[2], q[3]]


def rotate(q, v):
    return multiply(multiply(q, [*v, 0]), conjugate(q))[:3]


def inverted(pose):
    q = conjugate(pose[4:])
    return [pose[0], *(-x for x in rotate(q, pose[1:4])), *q]
