"""What is drawn on the page, and changes there: surfaces, points, arrows, frames. Names are those of viser's tree."""
import numpy as np

from flash_sim.bag.rigid import quaternion_of

CLOTH, SEEN, RIGID, FORCE, HELD = (86, 132, 196), (235, 130, 30), (165, 165, 160), (205, 40, 50), (40, 150, 90)
BODIES = (CLOTH, (96, 160, 110), (190, 130, 90), (150, 110, 180))


class Surface:
    """Triangles with both sides."""

    def __init__(self, server, name, colour=CLOTH, opacity=None):
        self._server, self._name, self._look = server, name, {"color": colour, "opacity": opacity, "side": "double"}
        self._handle, self._triangles = None, None

    def show(self, vertices, triangles, visible=True):
        """vertices (V, 3) [m], triangles (T, 3)."""
        vertices = np.asarray(vertices, np.float32)
        if self._handle is None or not np.array_equal(self._triangles, triangles):
            self._handle = self._server.scene.add_mesh_simple(self._name, vertices, np.asarray(triangles), **self._look)
            self._triangles = triangles
        elif not np.array_equal(self._handle.vertices, vertices):
            self._handle.vertices = vertices
        self._handle.visible = visible


class Points:
    """A cloud."""

    def __init__(self, server, name, size, colour=SEEN):
        """size: of a point [m]."""
        self._server, self._name, self._size, self._colour = server, name, size, colour

    def show(self, points, visible=True):
        """points (n, 3) [m]."""
        self._server.scene.add_point_cloud(self._name, np.asarray(points, np.float32), self._colour, point_size=self._size,
                                           point_shape="circle", point_shading="flat", precision="float32", visible=visible)


class Arrow:
    """An arrow whose head is as large as fits."""

    def __init__(self, server, name, size, colour=FORCE):
        """size: of what it stands in [m]."""
        self._server, self._name, self._size, self._colour = server, name, size, colour

    def show(self, start, way, visible=True):
        """From a place (3,) along a way (3,) [m]; one that is too short is not seen."""
        length = float(np.linalg.norm(way))
        self._server.scene.add_arrows(self._name, np.array([[start, np.add(start, way)]], np.float32), self._colour,
                                      shaft_radius=0.006 * self._size, head_radius=0.016 * self._size,
                                      head_length=min(0.05 * self._size, 0.6 * length), visible=visible and length > 2e-3 * self._size)


def put(handle, matrix):
    """Moves what is drawn to a pose (4, 4)."""
    x, y, z, w = quaternion_of(matrix[:3, :3])
    handle.wxyz, handle.position = (w, x, y, z), matrix[:3, 3]


def table(header, rows):
    """Markdown of a table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)
