"""Pictures of depth cameras against closed forms and against rays that meet every triangle."""
import numpy as np
import pytest
from conftest import ROOT, start, write_scene

import flash_sim
from flash_sim.cameras import NOTHING, PICTURES, quaternions

ALL = tuple(PICTURES)
WIDTH, HEIGHT, LENS = 80, 60, (70.0, 72.0, 38.7, 30.2)
FROM_ABOVE = flash_sim.look_at([0.1, 0.1, 0.5], [0.1, 0.1, 0], [0, 1, 0])


def rays():
    """(height, width, 3) in the optical frame, with z = 1."""
    fx, fy, cx, cy = LENS
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    return np.stack([(u - cx) / fx, (v - cy) / fy, np.ones(u.shape)], axis=2)


def matrix(pose):
    """Rotation by the product of a quaternion with vectors, and place."""
    q, w = pose[3:6], pose[6]
    rotation = np.stack([x + 2 * w * np.cross(q, x) + 2 * np.cross(q, np.cross(q, x)) for x in np.eye(3)], axis=1)
    return rotation, pose[:3]


def add(sim, name="eye", pose=FROM_ABOVE, **settings):
    sim.add_camera(name, WIDTH, HEIGHT, *LENS, pose, **settings)


def random_poses(random, count, centre, spread):
    turns = random.normal(size=(count, 4))
    return np.concatenate([centre + spread * random.uniform(-1, 1, (count, 3)),
                           turns / np.linalg.norm(turns, axis=1, keepdims=True)], axis=1)


def meet(origin, directions, corners):
    """Depth at which rays meet triangles (T, 3, 3), in lengths of a ray: the least, its triangle, how near a ray comes to an
    edge, as a share of a triangle (Moeller and Trumbore 1997), and the ray's way through a layer of 1 m below that triangle."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(directions[:, None], b)
    s = origin - corners[:, 0]
    q = np.cross(s, a)
    determinant = np.einsum("td,rtd->rt", a, p)
    u = np.einsum("td,rtd->rt", s, p) / determinant
    v = directions @ q.T / determinant
    depth = np.einsum("td,td->t", b, q) / determinant
    inner = np.minimum(np.minimum(u, v), 1 - u - v)
    hit = np.where((inner >= 0) & (depth >= 1e-3), depth, np.inf)
    close = np.where(depth > 0, np.abs(inner), np.inf).min(axis=1)
    normals = np.cross(a, b)
    first = hit.argmin(axis=1)
    across = np.abs((directions * (normals / np.linalg.norm(normals, axis=1)[:, None])[first]).sum(axis=1))
    return hit.min(axis=1), first, close, 1 / across


def box_corners(size, pose):
    """12 triangles of a box by its faces."""
    rotation, place = matrix(pose)
    triangles = []
    for axis in range(3):
        for side in (-1, 1):
            along = [np.zeros(3), np.zeros(3), np.zeros(3)]
            along[0][axis], along[1][(axis + 1) % 3], along[2][(axis + 2) % 3] = side, 1, 1
            square = [along[0] + i * along[1] + j * along[2] for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            triangles += [[square[0], square[1], square[2]], [square[0], square[2], square[3]]]
    return np.array(triangles) * np.asarray(size) / 2 @ rotation.T + place


@pytest.mark.parametrize("tilt", [0.0, 0.4, -0.7, 1.2])
def test_a_plane_seen_obliquely_is_its_equation(sim, tilt):
    poses = np.array([flash_sim.look_at([0.3 * np.cos(e), 0.2, 0.6 + 0.1 * e], [np.tan(tilt), 0.1, 0]) for e in range(3)])
    add(sim, pose=poses, sees=["table"])
    seen = sim.render("eye", ALL)
    for e, pose in enumerate(poses):
        rotation, place = matrix(pose)
        slope = (rays() @ rotation.T)[..., 2]
        # Beyond 90 m the square that is drawn may end; at the horizon it does.
        depth = np.where(slope < 0, -place[2] / np.where(slope < 0, slope, 1), np.inf)
        met = depth < 90
        assert met.sum() > 1000
        length = np.linalg.norm(rays(), axis=2)
        assert (np.abs(seen["depth"][e] - depth)[met] <= 1.2e-7 * depth[met]).all()  # float32: 6e-8
        assert (np.abs(seen["distance"][e] - depth * length)[met] <= 1.2e-7 * (depth * length)[met]).all()
        assert (np.abs(seen["points"][e][met] - (depth[..., None] * (rays() @ rotation.T) + place)[met])
                <= 1.2e-7 * (1 + depth[met][:, None] * 2)).all()
        assert (seen["instance"][e][met] == sim.instances.index("table")).all()
        nothing = slope >= 0
        for name, empty in (("depth", 0), ("distance", 0), ("points", 0), ("instance", NOTHING), ("triangle", -1)):
            assert (seen[name][e][nothing] == empty).all(), name


def test_a_box_and_a_sphere_are_their_closed_forms(tmp_path):
    size, radius = np.array([0.1, 0.16, 0.06]), 0.07
    turned = np.array([0.05, -0.1, 0.2, *quaternions(np.linalg.qr(np.array([[2.0, 1, 0], [-1, 2, 1], [1, 0, 3]]))[0][None])[0]])
    sim = start(write_scene(tmp_path, obstacles={
        "box": {"shape": "box", "size": size.tolist(), "pose": turned.tolist()},
        "ball": {"shape": "sphere", "point": [0.3, 0.1, 0.1], "radius": radius}}))
    pose = flash_sim.look_at([0.4, -0.5, 0.6], [0.15, 0, 0.12])
    add(sim, "of box", pose, sees=["box"])
    add(sim, "of ball", pose, sees=["ball"])
    rotation, place = matrix(pose)
    ways = rays() @ rotation.T
    box_turn, box_place = matrix(turned)
    origin, inside = (place - box_place) @ box_turn, ways @ box_turn
    with np.errstate(divide="ignore"):
        ends = np.stack([(-0.5 * size - origin) / inside, (0.5 * size - origin) / inside])
    enters, leaves = ends.min(axis=0).max(axis=2), ends.max(axis=0).min(axis=2)
    depth = sim.render("of box", ("depth",))["depth"][0]
    assert (enters < leaves).sum() > 100 and np.array_equal(depth > 0, enters < leaves)
    assert np.abs(depth - enters)[depth > 0].max() < 1.2e-7
    seen = sim.render("of ball", ("depth", "points"))
    off = np.linalg.norm(seen["points"][0] - np.array([0.3, 0.1, 0.1], np.float32), axis=2)[seen["depth"][0] > 0]
    # Corners of its 48 x 24 facets lie on it, their middles by two halves of 7.5 degrees inside.
    assert len(off) > 50 and off.max() < radius * (1 + 1e-5) and off.min() > radius * np.cos(np.radians(3.75)) ** 2 * (1 - 1e-5)


def test_random_scenes_are_what_rays_meet(sim):
    """Crumpled towels, hands and cameras anywhere: of all triangles of all instances the nearest."""
    random = np.random.default_rng(11)
    add(sim)
    compared = 0
    for _ in range(6):
        towels = np.array([0.1, 0.1, 0.15]) + 0.1 * random.uniform(-1, 1, (3, 36, 3))
        hands = random_poses(random, 3, [0.1, 0.1, 0.15], 0.1)
        eyes = random_poses(random, 3, [0.1, 0.1, 0.2], 0.3)
        eyes[:2, 3:] = flash_sim.look_at(eyes[:2, :3], [0.1, 0.1, 0.15])[:, 3:]
        sim.reset(positions=towels)
        sim.move_ee("hand", hands)
        sim.step()
        towels = flash_sim.to_host(sim.positions())
        sim.set_camera("eye", eyes)
        seen = sim.render("eye", ALL)
        for e in range(3):
            rotation, place = matrix(eyes[e])
            ways = (rays() @ rotation.T).reshape(-1, 3)
            towel = towels[e][sim.triangles()]
            hand = box_corners([0.06, 0.06, 0.02], hands[e])
            met = [meet(place, ways, corners) for corners in (towel, hand)]
            table = np.where(ways[:, 2] * place[2] < 0, -place[2] / ways[:, 2], np.inf)
            horizon = (table > 90) & np.isfinite(table)  # where the square that is drawn may end
            table[horizon] = np.inf
            # Of both rigid bodies the nearer hides the towel, but for what lies within 2 mm of its surface.
            hand_first = met[1][0] < table
            rigid = np.where(hand_first, met[1][0], table)
            layer = 2e-3 * np.where(hand_first, met[1][3], 1 / np.abs(ways[:, 2]))
            shows = met[0][0] < rigid + layer
            depth = np.where(shows, met[0][0], rigid)
            none = ~np.isfinite(depth)
            instance = np.where(none, NOTHING, np.where(shows, 0, np.where(hand_first, 2, 1)))
            clear = np.minimum(met[0][2], met[1][2]) > 1e-6  # else rounding decides
            with np.errstate(invalid="ignore"):
                clear &= ~(np.abs(met[0][0] - rigid - layer) < 1e-9) & ~horizon
            assert np.array_equal(seen["instance"][e].ravel()[clear], instance[clear])
            assert np.abs(seen["depth"][e].ravel() - np.where(none, 0, depth))[clear].max() < 1e-5
            of_towel = clear & (instance == 0)
            assert np.array_equal(seen["triangle"][e].ravel()[of_towel], met[0][1][of_towel])
            compared += of_towel.sum()
    assert compared > 2000 and sim.instances == ["towel", "table", "hand"]


def test_what_is_nearer_hides(sim):
    add(sim)
    add(sim, "of towel", sees=["towel"])
    seen, alone = sim.render("eye"), sim.render("of towel")
    counts = [(seen["instance"] == k).sum() for k in range(3)]
    assert min(counts) > 100 and (alone["instance"] != 0).any()
    hidden = (alone["instance"] == 0) & (seen["instance"] == 2)
    assert hidden.any() and (seen["depth"][hidden] < alone["depth"][hidden]).all()
    of_hand = seen["depth"][seen["instance"] == 2]
    assert np.median(of_hand) == of_hand.min() == np.float32(0.44)  # its lid; the others are of its sides
    assert (seen["depth"][seen["instance"] == 0] == np.float32(0.5)).all()


@pytest.mark.parametrize("elevation", [90, 60, 30, 12])
def test_what_lies_on_a_table_is_seen_whole(scene, elevation):
    """Both are in one plane, so that rounding alone would decide."""
    sim = start(scene)
    way = np.array([0, -np.cos(np.radians(elevation)), np.sin(np.radians(elevation))])
    pose = flash_sim.look_at([0.1, 0.1, 0] + 0.6 * way, [0.1, 0.1, 0], [0, 1, 1])
    add(sim, "eye", pose)
    add(sim, "of towel", pose, sees=["towel"])
    seen, alone = sim.render("eye"), sim.render("of towel")
    assert np.array_equal(seen["instance"] == 0, alone["instance"] == 0) and (alone["instance"] == 0).sum() > 100


def test_what_passes_through_is_seen_where_it_is_named(scene):
    sim = start(scene)
    sim.add_ee("ghost", [0.1, 0.1, 0.1], collides=False)
    add(sim)
    add(sim, "all", sees=sim.instances)
    assert not (sim.render("eye")["instance"] == 2).any() and (sim.render("all")["instance"] == 2).any()


def test_pictures_are_of_the_present(sim):
    add(sim)
    first = sim.render("eye", ALL)
    sim.move_ee("hand", [0.1, 0.1, 0.2])
    assert all(np.array_equal(first[name], picture) for name, picture in sim.render("eye", ALL).items())  # not yet
    sim.step()
    lid = sim.render("eye")
    assert (lid["depth"][lid["instance"] == 2] == np.float32(0.29)).all()
    sim.reset(positions=flash_sim.to_host(sim.positions()) + [0, 0, 0.3])
    raised = sim.render("eye")
    assert raised["depth"][raised["instance"] == 0] == pytest.approx(0.2, abs=1e-6)
    sim.step(3)
    assert (sim.render("eye")["depth"] != raised["depth"]).any()
    sim.reset()
    assert all(np.array_equal(first[name], picture) for name, picture in sim.render("eye", ALL).items())


def test_an_obstacle_of_the_file_moves_with_its_trajectory(tmp_path):
    """To its end, however many steps the file asks for."""
    path = [{"t": 0, "translation": [0.1, 0.1, 0.1], "rotation_xyzw": [0, 0, 0, 1]},
            {"t": 0.1, "translation": [0.1, 0.1, 0.2], "rotation_xyzw": [0, 0, 0, 1]}]
    sim = start(write_scene(tmp_path, obstacles={"lift": {"shape": "box", "size": [0.04, 0.04, 0.02], "keyframes": path}}, steps=3),
                2)
    add(sim)
    add(sim, "riding", [0, 0, 0.3, 1, 0, 0, 0], carrier="lift")
    for steps, z in ((0, 0.1), (4, 0.14), (6, 0.2)):
        sim.step(steps)
        for camera, depth in (("eye", 0.5 - z - 0.01), ("riding", 0.29)):
            seen = sim.render(camera)
            assert seen["depth"][seen["instance"] == 1] == pytest.approx(depth, abs=1e-6)


def test_a_carried_camera_moves_with_the_hand(sim):
    turned_down = [0.0, 0, -0.02, 1, 0, 0, 0]
    add(sim, "wrist", turned_down, carrier="hand", sees=["table"])
    add(sim, "as matrix", np.diag([1.0, -1, -1, 1]) + [[0, 0, 0, 0], [0] * 4, [0, 0, 0, -0.02], [0] * 4], carrier="hand",
        sees=["table"])
    sim.move_ee("hand", [[0.2, 0.2, 0.05 + 0.1 * e] for e in range(3)])
    sim.step()
    for name in ("wrist", "as matrix"):
        depth = sim.render(name)["depth"]
        for e in range(3):
            assert depth[e] == pytest.approx(0.03 + 0.1 * e, abs=1e-7)


def test_environments_chosen_are_rows_of_all(sim):
    add(sim)
    sim.move_ee("hand", [[0.1, 0.1, 0.05 + 0.03 * e] for e in range(3)])
    sim.step()
    sim.set_camera("eye", flash_sim.look_at([0.1, 0, 0.7], [0.1, 0.1, 0]), env_ids=1)
    everything = sim.render("eye", ALL)
    some = sim.render("eye", ALL, env_ids=[2, 0])
    assert all(np.array_equal(some[name], everything[name][[2, 0]]) for name in ALL)
    assert len(sim.render("eye", env_ids=[])["depth"]) == 0
    assert not np.array_equal(everything["depth"][0], everything["depth"][1])
    for name, (kind, pixel) in PICTURES.items():
        assert everything[name].dtype == kind and everything[name].shape == (3, HEIGHT, WIDTH) + pixel


def test_an_environment_is_the_same_alone_and_on_any_number_of_threads(scene):
    def pictures(n_envs, threads, first=0):
        sim = start(scene, n_envs, threads=threads)
        sim.add_ee("hand", [[0.1, 0.1, 0.1 + 0.05 * (first + e)] for e in range(n_envs)])
        add(sim)
        return sim.render("eye", ALL)
    one = pictures(3, 1)
    for many in (pictures(3, 2), pictures(3, 5)):
        assert all(np.array_equal(one[name], many[name]) for name in ALL)
    assert all(np.array_equal(one[name][2:], picture) for name, picture in pictures(1, 1, first=2).items())


def test_arrays_of_the_caller_are_written_to(sim):
    add(sim)
    clean = sim.render("eye", ALL)
    batch = np.full((2, 3, HEIGHT, WIDTH), 7, np.float32)
    ids = np.zeros((3, HEIGHT, WIDTH), np.int32)
    given = {"depth": batch[0], "triangle": ids}
    drawn = sim.render("eye", out=given)
    assert drawn["depth"] is given["depth"] and drawn["triangle"] is ids and list(drawn) == ["depth", "triangle"]
    assert np.array_equal(batch[0], clean["depth"]) and (batch[1] == 7).all() and np.array_equal(ids, clean["triangle"])
    assert list(sim.render("eye", "points")) == ["points"]


class There:
    """An array of a CUDA device by its word; its memory is not looked at."""

    def __init__(self, array, device=0):
        self.array, self.device = array, device

    def __dlpack_device__(self):
        return 2, self.device

    def __dlpack__(self, **_):
        return self.array.__dlpack__()


def test_arrays_of_another_device_are_refused(scene):
    sim = start(scene, 3)
    add(sim)
    depth, instance = np.zeros((3, HEIGHT, WIDTH), np.float32), np.zeros((3, HEIGHT, WIDTH), np.uint8)
    for out in ({"depth": There(depth)}, {"depth": depth, "instance": There(instance)}):
        with pytest.raises(ValueError, match="found an array on cuda:0, expected one of numpy$"):
            sim.render("eye", out=out)
    assert not depth.any() and not instance.any()


class Liar(np.ndarray):
    """Says that it is as long as asked."""
    shape = property(lambda _: (3, HEIGHT, WIDTH))


class Odd:
    """Speaks DLPack, badly."""

    def __init__(self, device, capsule=None):
        self.device, self.capsule = device, capsule

    def __dlpack_device__(self):
        return self.device

    def __dlpack__(self, **_):
        return self.capsule


def test_arrays_that_are_none_or_one_for_two_are_refused(scene):
    sim = start(scene, 3)
    add(sim)
    shape = (3, HEIGHT, WIDTH)
    one, two = np.zeros(shape, np.float32), np.zeros((4, HEIGHT, WIDTH), np.float32)
    for out in ({"depth": one, "distance": one}, {"depth": two[:3], "distance": two[1:]}):
        with pytest.raises(ValueError, match="render: out: distance: found the memory of depth"):
            sim.render("eye", out=out)
    for odd in (Odd(None), Odd(()), Odd(2), Odd((2, 0)), Odd((2, 0), 5), Odd((1, 0), one.__dlpack__())):
        with pytest.raises(TypeError, match="render: out: depth: found Odd, expected an array of float32") as raised:
            sim.render("eye", out={"depth": odd})
        assert "\n" not in str(raised.value)
    with pytest.raises(ValueError, match="render: out: depth: found 4 numbers, expected"):
        sim.render("eye", out={"depth": np.zeros(4, np.float32).view(Liar)})
    sim.render("eye", out={"depth": two[:3], "instance": np.zeros(shape, np.uint8)})


def test_the_listing_of_the_document_makes_a_picture(tmp_path, monkeypatch):
    listing = (ROOT / "docs/cameras.md").read_text().split("```python")[1].split("```")[0]
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(listing.replace("examples/", f"{ROOT}/examples/"), names)
    picture = (tmp_path / "fold.pgm").read_bytes()
    assert picture.startswith(b"P5 320 240 255\n") and len(picture) == 15 + 320 * 240
    assert names["depth"].min() > 0.3 and len(set(picture[15:])) > 100


NAN = float("nan")
SHEAR = np.eye(4) + 0.1 * np.eye(4, k=1)
BAD_POSES = [NAN, [NAN] * 7, [0.0] * 7, [0, 0, 0], "up", None, SHEAR, np.diag([1.0, 1, -1, 1]), np.diag([2.0, 2, 2, 1]),
             np.full((4, 4), NAN), np.eye(4)[:3], np.ones((2, 7)), np.eye(4)[[0, 1, 2, 0]], np.eye(3), [0, 0, 1, 0, 0, 0, 2], [1e300, 0, 1, 0, 0, 0, 1], np.eye(4) + 1e6 * np.eye(4, k=3)]
GOOD = {"name": "new", "width": 8, "height": 6, "fx": 9.0, "fy": 9.0, "cx": 3.5, "cy": 2.5, "pose": FROM_ABOVE}
BAD_CAMERAS = [
    *[{"pose": pose} for pose in BAD_POSES],
    *[{side: value} for side in ("width", "height") for value in (0, -1, 1.5, "8", None, 10**6, True)],
    *[{length: value} for length in ("fx", "fy") for value in (0, -1, NAN, "long", None, [1, 2])],
    *[{centre: value} for centre in ("cx", "cy") for value in (NAN, float("inf"), "middle", None)],
    *[{"name": name} for name in ("", None, 3, "eye", "\ud800")],
    *[{"carrier": name} for name in ("", 3, "foot", "towel", "table", "\udfff")],
    *[{"sees": names} for names in ([], "towel", ["foot"], [3], 3, [None])]]


@pytest.mark.parametrize("change", BAD_CAMERAS, ids=str)
def test_bad_cameras_are_refused_by_name(sim, change):
    add(sim)
    with pytest.raises((ValueError, TypeError), match="found") as raised:
        sim.add_camera(**GOOD | change)
    assert str(raised.value).startswith(f"add_camera: {next(iter(change))}: found") and "\n" not in str(raised.value)
    assert sim.cameras == ["eye"]
    sim.add_camera(**GOOD)
    assert sim.cameras == ["eye", "new"]


def test_bad_calls_are_refused_by_name(sim):
    add(sim)
    before = sim.render("eye", ALL)
    shape = (3, HEIGHT, WIDTH)
    calls = [
        *[("set_camera", "pose", ("eye", pose), {}) for pose in BAD_POSES],
        *[("set_camera", "name", (name, FROM_ABOVE), {}) for name in ("", "nose", None, 3)],
        *[("set_camera", "env_ids", ("eye", FROM_ABOVE, ids), {}) for ids in (3, [0, 0], "all", [True])],
        *[("render", "name", (name,), {}) for name in ("", "nose", None, 3, ["eye"])],
        *[("render", "pictures", ("eye", names), {}) for names in (["colour"], 3, "colour", [None])],
        *[("render", "env_ids", ("eye", None, ids), {}) for ids in (3, -1, [0, 0], "all")],
        *[("render", "out", ("eye",), {"out": out}) for out in (
            {}, [], np.zeros(shape, np.float32), {"colour": np.zeros(shape, np.float32)}, {"depth": np.zeros(shape)},
            {"depth": np.zeros(shape[1:], np.float32)}, {"depth": np.zeros((2,) + shape[1:], np.float32)}, {"depth": None},
            {"points": np.zeros(shape, np.float32)}, {"depth": np.zeros((3, HEIGHT, 2 * WIDTH), np.float32)[:, :, ::2]},
            {"depth": np.broadcast_to(np.float32(0), shape)}, {"instance": np.zeros(shape, np.int32)})],
        ("render", "out", ("eye", ("depth",)), {"out": {"depth": np.zeros(shape, np.float32)}})]
    for call, what, arguments, named in calls:
        with pytest.raises((ValueError, TypeError), match="found") as raised:
            getattr(sim, call)(*arguments, **named)
        assert str(raised.value).startswith((f"{call}: {what}: found", f"{call}: {what}: depth", f"{call}: {what}: p", f"{call}: {what}: i",
                                             "render: found pictures and out")) and "\n" not in str(raised.value), (call, str(raised.value))
    assert all(np.array_equal(before[name], picture) for name, picture in sim.render("eye", ALL).items())
    for call in (flash_sim.RealtimeSim().add_camera, flash_sim.RealtimeSim().set_camera, flash_sim.RealtimeSim().render):
        with pytest.raises(RuntimeError, match="initialize"):
            call(**(GOOD if call.__name__ == "add_camera" else {"name": "eye"} | ({"pose": 0} if "set" in call.__name__ else {})))


def test_numbers_that_are_none_hide_nothing_else(sim):
    add(sim)
    sim.reset(0, positions=flash_sim.to_host(sim.positions())[:1] * 1e300)
    sim.step()
    seen = sim.render("eye")
    assert (seen["instance"][0] == 1).any() and (seen["instance"][1] == 0).any()


def test_cameras_look_at_their_target():
    random = np.random.default_rng(4)
    positions, targets = random.normal(size=(50, 3)), random.normal(size=(50, 3))
    for pose, position, target in zip(flash_sim.look_at(positions, targets), positions, targets):
        rotation, place = matrix(pose)
        away = (target - position) @ rotation
        assert np.allclose(away, [0, 0, np.linalg.norm(target - position)], atol=1e-12) and np.array_equal(place, position)
        assert rotation[2, 1] <= 0 and abs(rotation[2, 0]) < 1e-12  # upright: y down, x level
    for down in ([0, 0, 0], [0, 0, 2]):
        rotation, _ = matrix(flash_sim.look_at([0, 0, 1], down))
        assert np.allclose(rotation[:, 0], [1, 0, 0])
    assert np.allclose(matrix(flash_sim.look_at([0, 0, 0], [1, 0, 0], [1, 0, 0]))[0][:, 0], [0, 1, 0])
    straight = matrix(flash_sim.look_at([0, 0, 0], [1, 0, 0]))[0]
    for large in (1e-300, 1e200, 1e308):  # whose squares are no numbers
        assert np.array_equal(matrix(flash_sim.look_at([0, 0, 0], [1, 0, 0], [0, 0, large]))[0], straight)
    for what, far in ("position", ([1e308, 0, 0], [-1e308, 0, 0])), ("target", ([0, 0, 0], [0, 1e200, 0])):
        with pytest.raises(ValueError, match=f"look_at: {what}: found 1e\\+[0-9]* m in row 0, expected at most 100000 m"):
            flash_sim.look_at(*far)
    for wrong in (([0, 0, 1], [0, 0, 1]), ([0, 0], [0, 0, 1]), ([0, 0, 1], [0, 0, 0], [0, 0, 0]), ("a", [0, 0, 0]),
                  (np.zeros((2, 3)), np.ones((3, 3)))):
        with pytest.raises((ValueError, TypeError), match="look_at"):
            flash_sim.look_at(*wrong)


def test_quaternions_are_those_of_their_rotations():
    random = np.random.default_rng(9)
    turns = random.normal(size=(200, 4))
    turns[:12] = np.tile(np.eye(4), (3, 1)) + 1e-9 * turns[:12]  # half turns, and none
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    rotations = np.stack([matrix(np.concatenate([np.zeros(3), turn]))[0] for turn in turns])
    found = quaternions(rotations)
    assert np.abs(np.abs((found * turns).sum(axis=1)) - 1).max() < 1e-14
