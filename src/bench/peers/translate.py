"""Reads a scene of Mitsuba 3 for renderers that have no reader of their own.

The text of this file is put before that of such a peer. It makes plain data of a scene: meshes in world
coordinates, local models, lights and the camera as dictionaries. What it does not know is an error that names the
element, since a scene that lacks something would be compared as if it were whole.
"""
import math, os, struct, zlib
import xml.etree.ElementTree as ElementTree
try:
    import numpy as np
except ImportError:
    np = None  # The peer asks for its package first, which brings numpy.

IORS = {"vacuum": 1.0, "air": 1.000277, "water ice": 1.31, "water": 1.333, "fused quartz": 1.458, "pyrex": 1.47,
        "acrylic glass": 1.49, "polypropylene": 1.49, "bk7": 1.5046, "amber": 1.55, "diamond": 2.419}
# eta and k for linear sRGB; `none` is a perfect mirror.
METALS = {"Ag": ((0.155276, 0.116728, 0.138388), (4.82835, 3.12222, 2.1469)),
          "Al": ((1.6575, 0.880405, 0.521244), (9.22381, 6.2695, 4.837)),
          "Au": ((0.143036, 0.375307, 1.44205), (3.983, 2.38556, 1.60336)),
          "Cr": ((4.36967, 2.91651, 1.6549), (5.20655, 4.23131, 3.7547)),
          "Cu": ((0.201005, 0.92375, 1.10222), (3.91326, 2.45305, 2.14209))}
# What changes nothing in the expected image, or is told to the peer by the setup.
WITHOUT_EFFECT = {"sampler", "integrator", "sampling_weight", "silhouette_sampling_weight", "sample_visible",
                  "shutter_open", "shutter_close", "file_format", "pixel_format", "component_format", "banner", "accel",
                  "format", "mis_compensation"}


class Thing:
    """An object of the scene, which notes what was asked of it: the rest would be lost."""

    def __init__(self, node):
        self.tag, self.type, self.id = node.tag, node.get("type"), node.get("id")
        self.values, self.nested = {}, []

    def __str__(self):
        return f"<{self.tag} type=\"{self.type}\"{f' id={chr(34)}{self.id}{chr(34)}' if self.id else ''}>"

    def unknown(self, what=""):
        return ValueError(f"{self} {what or 'is not known to this peer'}")

    def get(self, name, default=None):
        return self.values.pop(name, default)

    def take(self, tag):
        """The nested objects of this kind."""
        found = [thing for thing in self.nested if thing.tag == tag]
        self.nested = [thing for thing in self.nested if thing.tag != tag]
        return found

    def done(self):
        rest = [name for name in self.values if name not in WITHOUT_EFFECT]
        rest += [str(thing) for thing in self.nested if thing.tag not in WITHOUT_EFFECT]
        if rest:
            raise self.unknown(f"has `{rest[0]}`, which is not known to this peer")


def numbers_of(text):
    return [float(word) for word in text.replace(",", " ").split()]


def vector_of(node, default):
    if node.get("value") is not None:
        v = numbers_of(node.get("value"))
        return np.array(v * 3 if len(v) == 1 else v)
    return np.array([float(node.get(axis, default)) for axis in "xyz"])


def colour_of(node):
    text = node.get("value").strip()
    if text.startswith("#"):
        return srgb_to_linear(np.array([int(text[i:i + 2], 16) / 255 for i in (1, 3, 5)]))
    v = numbers_of(text)
    return np.array(v * 3 if len(v) == 1 else v)


def srgb_to_linear(x):
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def frame_of(z):
    """Three axes as columns, the last of them given."""
    x = np.cross(z, (1, 0, 0) if abs(z[0]) < 0.7 else (0, 1, 0))
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], 1)


def transform_of(node):
    """The steps apply one after the other, so that later ones multiply from the left."""
    total = np.eye(4)
    for step in node:
        m = np.eye(4)
        if step.tag == "translate":
            m[:3, 3] = vector_of(step, 0)
        elif step.tag == "scale":
            m[:3, :3] = np.diag(vector_of(step, 1))
        elif step.tag == "rotate":
            axis, angle = vector_of(step, 0), math.radians(float(step.get("angle")))
            x, y, z = axis / np.linalg.norm(axis)
            k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            m[:3, :3] += math.sin(angle) * k + (1 - math.cos(angle)) * k @ k
        elif step.tag == "lookat":
            origin, target, up = (np.array(numbers_of(step.get(name))) for name in ("origin", "target", "up"))
            ahead = (target - origin) / np.linalg.norm(target - origin)
            left = np.cross(up, ahead)
            left /= np.linalg.norm(left)
            m[:3, :] = np.stack([left, np.cross(ahead, left), ahead, origin], axis=1)
        elif step.tag == "matrix":
            v = np.array(numbers_of(step.get("value")))
            m[:3, :3] = v.reshape(3, 3) if len(v) == 9 else v.reshape(4, 4)[:3, :3]
            m[:3, 3] = 0 if len(v) == 9 else v.reshape(4, 4)[:3, 3]
        else:
            raise ValueError(f"<{step.tag}> in a transform is not known to this peer")
        total = m @ total
    return total


def things_of(root, define):
    """The objects at top level, with `$name` filled in and references followed."""
    known, nodes = dict(define), {}

    def fill(node):
        for name in sorted(known, key=len, reverse=True):
            for key, text in node.attrib.items():
                node.attrib[key] = text.replace("$" + name, str(known[name]))
        if node.tag == "default":
            known.setdefault(node.get("name"), node.get("value"))
        elif node.get("id") and node.tag != "ref":
            nodes[node.get("id")] = node
        for child in node:
            fill(child)

    def thing(node):
        made = Thing(node)
        for child in node:
            name = child.get("name")
            if child.tag == "ref":
                if child.get("id") not in nodes:
                    raise made.unknown(f"refers to `{child.get('id')}`, which is not in the scene")
                child = nodes[child.get("id")]
            if child.tag in ("float", "integer"):
                made.values[name] = float(child.get("value"))
            elif child.tag == "boolean":
                made.values[name] = child.get("value").strip().lower() == "true"
            elif child.tag == "string":
                made.values[name] = child.get("value")
            elif child.tag in ("point", "vector"):
                made.values[name] = vector_of(child, 0)
            elif child.tag == "rgb":
                made.values[name] = colour_of(child)
            elif child.tag == "transform":
                made.values[name] = transform_of(child)
            elif child.tag == "texture":
                made.values[name] = thing(child)
            elif child.tag in ("bsdf", "emitter", "shape", "film", "sampler", "rfilter", "integrator"):
                made.nested.append(thing(child))
            else:
                raise made.unknown(f"has <{child.tag}>, which is not known to this peer")
        return made

    fill(root)
    return [thing(node) for node in root if node.tag != "default"]


def texture_of(value, thing, folder):
    """A colour as an array, or a texture as a dictionary."""
    if isinstance(value, (float, int)):
        return np.full(3, float(value))
    if not isinstance(value, Thing):
        return value
    m = value.get("to_uv", np.eye(4))
    if m[0, 1] or m[1, 0]:
        raise value.unknown("has a `to_uv` that turns, which is not known to this peer")
    made = {"type": value.type, "scale": (m[0, 0], m[1, 1]), "offset": (m[0, 3], m[1, 3])}
    if value.type == "bitmap":
        made.update(file=os.path.join(folder, value.get("filename")), raw=value.get("raw", False),
                    filter=value.get("filter_type", "bilinear"), wrap=value.get("wrap_mode", "repeat"))
        if not os.path.isfile(made["file"]):
            raise value.unknown(f"names `{made['file']}`, which is not there")
    elif value.type == "checkerboard":
        made["colors"] = [texture_of(value.get(f"color{i}", c), thing, folder) for i, c in ((0, 0.4), (1, 0.2))]
        if any(isinstance(c, dict) for c in made["colors"]):
            raise value.unknown("has textures in it, which is not known to this peer")
    else:
        raise value.unknown()
    value.done()
    return made


def ior_of(value, thing):
    if isinstance(value, str):
        if value not in IORS:
            raise thing.unknown(f"has the dielectric `{value}`, which is not known to this peer")
        return IORS[value]
    return value


def bsdf_of(thing, folder):
    """A local model: `type`, then what it has, with all defaults of Mitsuba filled in."""
    made = {"type": thing.type, "id": thing.id}
    get = lambda name, default: texture_of(thing.get(name, default), thing, folder)
    rough = thing.type.startswith("rough")
    if thing.type == "diffuse":
        made["reflectance"] = get("reflectance", 0.5)
    elif thing.type in ("dielectric", "roughdielectric", "thindielectric"):
        made.update(reflectance=get("specular_reflectance", 1), transmittance=get("specular_transmittance", 1))
    elif thing.type in ("conductor", "roughconductor"):
        material, eta, k = thing.get("material", "none"), thing.get("eta"), thing.get("k")
        if eta is None and material != "none":
            if material not in METALS:
                raise thing.unknown(f"has the material `{material}`, which is not known to this peer")
            eta, k = METALS[material]
        if eta is not None:
            eta, k = (texture_of(v if isinstance(v, Thing) else np.ones(3) * v, thing, folder) for v in (eta, k))
        # Without eta it is a mirror.
        made.update(reflectance=get("specular_reflectance", 1), eta=eta, k=k)
    elif thing.type in ("plastic", "roughplastic"):
        made.update(reflectance=get("specular_reflectance", 1), diffuse=get("diffuse_reflectance", 0.5),
                    nonlinear=thing.get("nonlinear", False))
    elif thing.type in ("twosided", "blendbsdf", "mask"):
        made["sides"] = [bsdf_of(side, folder) for side in thing.take("bsdf")]
        if len(made["sides"]) not in {"twosided": (1, 2), "blendbsdf": (2,), "mask": (1,)}[thing.type]:
            raise thing.unknown("has the wrong number of local models")
        if thing.type == "blendbsdf":
            made["weight"] = get("weight", 0.5)
        elif thing.type == "mask":
            made["opacity"] = get("opacity", 0.5)
    elif thing.type != "null":
        raise thing.unknown()
    if "dielectric" in thing.type or "plastic" in thing.type:
        inside = "polypropylene" if "plastic" in thing.type else "bk7"
        made.update(int_ior=ior_of(thing.get("int_ior", inside), thing), ext_ior=ior_of(thing.get("ext_ior", "air"), thing))
    if rough:
        alpha = thing.get("alpha", 0.1)
        made.update(distribution=thing.get("distribution", "beckmann"), alpha_u=thing.get("alpha_u", alpha),
                    alpha_v=thing.get("alpha_v", alpha))
        if isinstance(made["alpha_u"], Thing) or isinstance(made["alpha_v"], Thing):
            raise thing.unknown("has a texture for its roughness, which is not known to this peer")
    thing.done()
    return made


def has_texture(bsdf):
    return any(isinstance(v, dict) or (isinstance(v, list) and any(has_texture(s) for s in v)) for v in bsdf.values())


def is_black(bsdf):
    return bsdf["type"] == "diffuse" and not has_texture(bsdf) and not bsdf["reflectance"].any()


def base_share(bsdf):
    """How much of its reflectance the base of a plastic shows under even light, and what the coat sends back inside.

    Mitsuba's rough coat loses what its facets would reflect more than once, up to a third; other renderers do not.
    """
    eta, alpha, n = bsdf["int_ior"] / bsdf["ext_ior"], bsdf.get("alpha_u", 1e-3), 24
    mid = (np.arange(n) + 0.5) / n
    mu, u, v = np.meshgrid(mid, mid, mid, indexing="ij")
    w = np.stack([np.sqrt(1 - mu * mu), 0 * mu, mu], -1)

    def masking(cos):
        return 2 / (1 + np.sqrt(1 + alpha * alpha * np.maximum(1 - cos * cos, 0) / np.maximum(cos * cos, 1e-9)))

    # Facets of GGX that are visible from w, after Heitz 2018.
    h = w * (alpha, alpha, 1)
    h /= np.linalg.norm(h, axis=-1, keepdims=True)
    s, x, y = (1 + h[..., 2]) / 2, np.sqrt(u) * np.cos(2 * math.pi * v), np.sqrt(u) * np.sin(2 * math.pi * v)
    y = (1 - s) * np.sqrt(1 - x * x) + s * y
    z = np.sqrt(np.maximum(1 - x * x - y * y, 0))
    m = np.stack([alpha * (z * h[..., 0] - y * h[..., 2]), alpha * x, z * h[..., 2] + y * h[..., 0]], -1)
    m[..., 2] = np.maximum(m[..., 2], 1e-6)
    m /= np.linalg.norm(m, axis=-1, keepdims=True)
    cos = np.maximum((w * m).sum(-1), 1e-6)

    def fresnel(eta):
        below = 1 - (1 - cos * cos) / (eta * eta)
        t = np.sqrt(np.maximum(below, 0))
        parallel, across = (eta * cos - t) / (eta * cos + t), (cos - eta * t) / (cos + eta * t)
        return np.where(below > 0, (parallel**2 + across**2) / 2, 1.0), t

    f, t = fresnel(eta)
    refracted = (cos / eta - t)[..., None] * m - w / eta
    reach = np.where(refracted[..., 2] < 0, masking(np.abs(refracted[..., 2])) * (1 - f), 0)
    f, _ = fresnel(1 / eta)
    mirrored = 2 * cos * m[..., 2] - mu
    inside = np.where(mirrored > 0, masking(mirrored) * f, 0)
    reach, inside = (2 * (x.mean((1, 2)) * mid).mean() for x in (reach, inside))
    return reach * reach / (eta * eta * (1 - inside)), inside


def base_of(bsdf):
    """The factor on a plastic's reflectance, with the shift of colours by reflections inside where it can be had."""
    share, inside = base_share(bsdf)
    if bsdf["nonlinear"] and not isinstance(bsdf["diffuse"], dict):
        return share * (1 - inside) / (1 - inside * bsdf["diffuse"])
    return share


def obj_mesh(path, flip_v):
    """Positions, normals, texture coordinates and triangles; a vertex is a distinct triple of them."""
    pools, keys, triangles = {"v": [], "vt": [], "vn": []}, {}, []
    with open(path, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            word, *rest = line.split() or [""]
            if word in pools:
                pools[word].append([float(x) for x in rest[:2 if word == "vt" else 3]])
            elif word == "f":
                corners = []
                for corner in rest:
                    # Numbers below zero count from the end of what was read so far.
                    key = tuple((int(i) - 1 if int(i) > 0 else len(pool) + int(i)) if i else -1
                                for i, pool in zip(corner.split("/"), pools.values()))
                    corners.append(keys.setdefault(key, len(keys)))
                triangles += [(corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)]
    index = [np.array([key[i] if len(key) > i else -1 for key in keys]) for i in range(3)]
    p, uv, n = (np.array(pool)[i] if pool and (i >= 0).all() else None for pool, i in zip(pools.values(), index))
    if uv is not None and flip_v:
        uv[:, 1] = 1 - uv[:, 1]
    return p, n, uv, np.array(triangles)


PLY_TYPES = {"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
             "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
             "double": "f8", "float64": "f8"}


def ply_mesh(path, flip_v):
    """The same from a PLY file, ASCII or little endian, whose faces have one list."""
    data = open(path, "rb").read()
    header, body = data.split(b"end_header", 1)
    body, elements, ascii = body[body.index(b"\n") + 1:], [], b"format ascii" in header
    if not ascii and b"binary_little_endian" not in header:
        raise ValueError(f"`{path}` is neither an ASCII nor a little endian PLY file")
    for words in (line.split() for line in header.decode().splitlines()):
        if words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
    words, at = iter(body.split()) if ascii else None, 0
    vertices, triangles = None, []
    for name, count, properties in elements:
        if name == "vertex":
            names = [p[1] for p in properties]
            if ascii:
                rows = np.array([float(next(words)) for _ in range(count * len(names))]).reshape(count, -1)
                vertices = {n: rows[:, i] for i, n in enumerate(names)}
            else:
                kind = np.dtype([(p[1], "<" + PLY_TYPES[p[0]]) for p in properties])
                vertices = np.frombuffer(body, kind, count, at)
                at += count * kind.itemsize
        elif name == "face" and len(properties) == 1 and properties[0][0] == "list":
            sizes = [np.dtype("<" + PLY_TYPES[t]) for t in properties[0][1:3]]
            for _ in range(count):
                if ascii:
                    face = [int(next(words)) for _ in range(int(next(words)))]
                else:
                    length = int(np.frombuffer(body, sizes[0], 1, at)[0])
                    face = np.frombuffer(body, sizes[1], length, at + sizes[0].itemsize)
                    at += sizes[0].itemsize + length * sizes[1].itemsize
                triangles += [(face[0], face[i], face[i + 1]) for i in range(1, len(face) - 1)]
        elif count:
            raise ValueError(f"`{path}` has an element `{name}` that is not known to this peer")
        names = names if name == "vertex" else []
    has = (vertices.dtype.names if not ascii else vertices.keys())

    def columns(*names):
        return np.stack([vertices[n] for n in names], 1).astype(float) if all(n in has for n in names) else None

    uv = columns("u", "v")
    uv = columns("s", "t") if uv is None else uv
    if uv is not None and flip_v:
        uv[:, 1] = 1 - uv[:, 1]
    return columns("x", "y", "z"), columns("nx", "ny", "nz"), uv, np.array(triangles, dtype=np.int64)


def icosphere(level):
    """The unit sphere in 20 · 4^level triangles of about the same size."""
    g = (1 + 5 ** 0.5) / 2
    p = np.array([(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g),
                  (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]) / math.hypot(1, g)
    t = np.array([(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
                  (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10),
                  (8, 6, 7), (9, 8, 1)])
    for _ in range(level):
        edges = np.sort(np.concatenate([t[:, (0, 1)], t[:, (1, 2)], t[:, (2, 0)]]), axis=1)
        edges, number = np.unique(edges, axis=0, return_inverse=True)
        middle = p[edges].sum(1)
        ab, bc, ca = number.reshape(3, -1) + len(p)
        p = np.concatenate([p, middle / np.linalg.norm(middle, axis=1, keepdims=True)])
        a, b, c = t.T
        t = np.concatenate([np.stack(x, 1) for x in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    return p, t


def grid(rows, columns):
    """Triangles between points that are numbered row by row."""
    a = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    b, c, d = a + 1, a + columns, a + columns + 1
    return np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])


def shape_points(thing, folder, emits):
    """Positions, normals, texture coordinates and triangles of a shape before `to_world`."""
    if thing.type in ("obj", "ply"):
        reader = obj_mesh if thing.type == "obj" else ply_mesh
        path, flip_v = os.path.join(folder, thing.get("filename")), thing.get("flip_tex_coords", thing.type == "obj")
        if not os.path.isfile(path):
            raise thing.unknown(f"names `{path}`, which is not there")
        p, n, uv, t = reader(path, flip_v)
        return p, None if thing.get("face_normals", False) else n, uv, t
    if thing.type == "rectangle":
        p = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], dtype=float)
        return p, np.tile((0, 0, 1), (4, 1)), (p[:, :2] + 1) / 2, np.array([(0, 1, 2), (0, 2, 3)])
    if thing.type == "cube":
        square = np.array([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)], dtype=float)
        p = np.concatenate([np.roll(square, i, 1) * sign for i in range(3) for sign in (1, -1)])
        n = np.concatenate([np.tile(np.roll((0, 0, sign), i), (4, 1)) for i in range(3) for sign in (1, -1)])
        return p, n, None, np.concatenate([[(i, i + 1, i + 2), (i, i + 2, i + 3)] for i in range(0, 24, 4)])
    angle = np.linspace(0, 2 * math.pi, 257)
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
    if thing.type == "disk":
        p = np.concatenate([[(0, 0, 0)], ring[:-1]])
        t = np.stack([np.zeros(256, int), 1 + np.arange(256), 1 + np.arange(1, 257) % 256], 1)
        return p, np.tile((0, 0, 1), (257, 1)), None, t
    if thing.type == "cylinder":
        ends = [np.asarray(thing.get("p0", np.zeros(3))), np.asarray(thing.get("p1", np.array([0.0, 0, 1])))]
        z = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        n, radius = ring @ frame_of(z).T, thing.get("radius", 1.0)
        return np.concatenate([e + radius * n for e in ends]), np.tile(n, (2, 1)), None, grid(2, 257)
    if thing.type == "sphere":
        # 82k triangles with the exact normals refract like the sphere itself. Of an emitter every triangle is a light
        # of its own, so that it gets few, blown up to the area of the sphere, hence to its power.
        n, t = icosphere(3 if emits else 6)
        radius = thing.get("radius", 1.0)
        if emits:
            radius *= (4 * math.pi / area_of(n, t)) ** 0.5
        return np.asarray(thing.get("center", np.zeros(3))) + radius * n, n, None, t
    raise thing.unknown()


def area_of(p, t):
    return np.linalg.norm(np.cross(p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]]), axis=1).sum() / 2


def mesh_of(thing, folder, place=None):
    """A shape in world coordinates; triangles go round its normals counterclockwise."""
    emitters, bsdfs = thing.take("emitter"), thing.take("bsdf")
    radiance = None
    for emitter in emitters:
        if emitter.type != "area":
            raise emitter.unknown("in a shape is not known to this peer")
        radiance = texture_of(emitter.get("radiance", 1.0), emitter, folder)
        if isinstance(radiance, dict):
            raise emitter.unknown("has a texture, which is not known to this peer")
        emitter.done()
    bsdf = bsdf_of(bsdfs[0], folder) if bsdfs else {"type": "diffuse", "id": None, "reflectance": np.full(3, 0.0 if emitters else 0.5)}
    m = (np.eye(4) if place is None else place) @ thing.get("to_world", np.eye(4))
    flip, sphere = thing.get("flip_normals", False), None
    scale = np.linalg.norm(m[:3, 0])
    is_round = np.allclose(m[:3, :3].T @ m[:3, :3] / scale**2, np.eye(3), atol=1e-5)
    if thing.type == "sphere" and is_round and not flip:
        sphere = (m @ np.append(thing.values.get("center", np.zeros(3)), 1.0))[:3], thing.values.get("radius", 1.0) * scale
    p, n, uv, t = shape_points(thing, folder, radiance is not None)
    thing.values.pop("face_normals", None)
    thing.done()
    p = p @ m[:3, :3].T + m[:3, 3]
    if n is not None:
        n = n @ np.linalg.inv(m[:3, :3])
        length = np.linalg.norm(n, axis=1, keepdims=True)
        if not length.all():
            raise thing.unknown("has vertices without a normal")
        n = n / length * (-1 if flip else 1)
        wrong = (np.cross(p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]]) * n[t].sum(1)).sum(1) < 0
    else:
        wrong = np.full(len(t), flip)
    t = np.where(wrong[:, None], t[:, ::-1], t)
    if uv is None and has_texture(bsdf):
        raise thing.unknown("has a texture, but no texture coordinates that are known to this peer")
    return {"name": thing.id or thing.type, "points": p, "normals": n, "uvs": uv, "triangles": t, "bsdf": bsdf,
            "radiance": radiance, "sphere": sphere}


def light_of(thing):
    made = {"type": thing.type}
    colour = lambda name: texture_of(thing.get(name, 1.0), thing, "")
    m = thing.get("to_world", np.eye(4))
    if thing.type == "point":
        made.update(position=thing.get("position", m[:3, 3]), intensity=colour("intensity"))
    elif thing.type == "spot":
        cutoff = thing.get("cutoff_angle", 20.0)
        made.update(position=m[:3, 3], direction=m[:3, 2] / np.linalg.norm(m[:3, 2]), intensity=colour("intensity"),
                    cutoff=cutoff, beam=thing.get("beam_width", 0.75 * cutoff))
    elif thing.type == "directional":
        direction = np.asarray(thing.get("direction", m[:3, 2]))
        made.update(direction=direction / np.linalg.norm(direction), irradiance=colour("irradiance"),
                    diameter=thing.get("angular_diameter", 0.0))
    elif thing.type == "constant":
        made["radiance"] = colour("radiance")
    else:
        raise thing.unknown()
    thing.done()
    return made


def camera_of(thing):
    if thing.type not in ("perspective", "thinlens"):
        raise thing.unknown()
    films = thing.take("film")
    film = films[0] if films else None
    w, h = (film.get("width", 768.0), film.get("height", 576.0)) if film else (768.0, 576.0)
    filters = film.take("rfilter") if film else []
    if film:
        film.done()
    m = thing.get("to_world", np.eye(4))
    axes = m[:3, :3] / np.linalg.norm(m[:3, :3], axis=0)
    if np.linalg.det(axes) < 0.999:
        raise thing.unknown("has a `to_world` that mirrors or shears, which is not known to this peer")
    axis, fov = thing.get("fov_axis", "x"), thing.get("fov")
    if fov is None:
        raise thing.unknown("has no `fov`, which this peer needs")
    axis = {"smaller": "x" if w < h else "y", "larger": "x" if w > h else "y"}.get(axis, axis)
    side = {"x": w, "y": h, "diagonal": math.hypot(w, h)}[axis]
    made = {"origin": m[:3, 3], "ahead": axes[:, 2], "up": axes[:, 1], "aspect": w / h,
            "fov_x": 2 * math.atan(math.tan(math.radians(fov) / 2) * w / side), "near": thing.get("near_clip", 0.01),
            "far": thing.get("far_clip", 1e4), "radius": 0.0, "focus": 1.0,
            "filter": filters[0].type if filters else "gaussian"}
    if thing.type == "thinlens":
        made.update(radius=thing.get("aperture_radius"), focus=thing.get("focus_distance", made["far"]))
    thing.done()
    return made


def read_scene(path, define):
    """The meshes, lights and the camera of a scene file."""
    folder = os.path.dirname(path)
    scene = {"meshes": [], "lights": [], "camera": None}
    # Local models at top level are read where they are used.
    for thing in things_of(ElementTree.parse(path).getroot(), define):
        if thing.tag == "sensor":
            scene["camera"] = scene["camera"] or camera_of(thing)
        elif thing.tag == "shape":
            if thing.type == "instance":
                place = thing.get("to_world", np.eye(4))
                scene["meshes"] += [mesh_of(s, folder, place) for group in thing.take("shape") for s in group.take("shape")]
                thing.done()
            elif thing.type != "shapegroup":
                scene["meshes"].append(mesh_of(thing, folder))
        elif thing.tag == "emitter":
            scene["lights"].append(light_of(thing))
        elif thing.tag not in ("bsdf", "texture", "integrator"):
            raise thing.unknown()
    if not scene["camera"]:
        raise ValueError("the scene has no sensor")
    for i, mesh in enumerate(scene["meshes"]):
        mesh["name"] = f"{i} {mesh['name']}"
    return scene


def png_pixels(path):
    """A PNG file as rows of pixels of 1 to 4 channels from 0 to 1; nothing where it is no such file."""
    data = open(path, "rb").read()
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        return None
    at, packed, palette = 8, b"", None
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        chunk = data[at + 8:at + 8 + size]
        at += 12 + size
        if kind == b"IHDR":
            width, height, bits, colour, _, _, interlaced = struct.unpack(">IIBBBBB", chunk)
        elif kind == b"PLTE":
            palette = np.frombuffer(chunk, np.uint8).reshape(-1, 3)
        elif kind == b"IDAT":
            packed += chunk
    if bits not in (8, 16) or interlaced:
        raise ValueError(f"`{path}` has {bits} bits or is interlaced, which is not known to this peer")
    channels = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[colour]
    step, raw = channels * bits // 8, zlib.decompress(packed)
    rows = np.frombuffer(raw, np.uint8).reshape(height, 1 + width * step)
    above, image = np.zeros(width * step, np.uint8), np.empty((height, width * step), np.uint8)
    for y, row in enumerate(rows):
        filter, row = row[0], row[1:]
        if filter == 1:
            row = np.cumsum(row.reshape(width, step), axis=0, dtype=np.uint8).ravel()
        elif filter == 2:
            row = row + above
        elif filter > 2:
            row, up = row.tolist(), above.tolist()
            for i in range(len(row)):
                a, b, c = (row[i - step], up[i], up[i - step]) if i >= step else (0, up[i], 0)
                if filter == 3:
                    guess = (a + b) // 2
                else:
                    da, db, dc = abs(b - c), abs(a - c), abs(a + b - 2 * c)
                    guess = a if da <= db and da <= dc else b if db <= dc else c
                row[i] = (row[i] + guess) & 255
        image[y] = above = np.array(row, np.uint8)
    image = image.reshape(height, width, step)
    if palette is not None:
        image = palette[image[..., 0]]
    elif bits == 16:
        image = image.reshape(height, width, channels, 2).astype(float) @ (256, 1) / 257
    return image / 255.0
