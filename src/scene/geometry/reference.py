#!/usr/bin/env python3
"""Writes reference.txt: what Mitsuba 3 finds where random rays meet its shapes (pip install mitsuba).

A line: shape, flip, mask of reflections, to_world (12 numbers by rows), o, d, then t, uv, n of the
shading frame, dp_du. The optional argument is the number of rays per case.
"""
import sys, tempfile, numpy as np, mitsuba as mi
mi.set_variant("scalar_rgb")
mi.set_log_level(mi.LogLevel.Error)
rng = np.random.default_rng(1)
rays = int(sys.argv[1]) if len(sys.argv) > 1 else 1
TENT = "v -1 -1 0\nv 1 -1 0\nv 0 0 1\nv 0 1.5 0\n"
UVS = "vt 0 0\nvt 1 .2\nvt .3 .9\nvt .8 1.5\n"
NORMALS = "vn -.5 -.5 1\nvn .5 -.5 1\nvn .1 .1 1\nvn 0 1 .2\n"
files = {"smooth": TENT + UVS + NORMALS + "f 1/1/1 2/2/2 3/3/3\nf 1/1/1 3/3/3 4/4/4\n",
         "faceted": TENT + UVS + "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n",
         "bare": TENT + NORMALS + "f 1//1 2//2 3//3\nf 1//1 3//3 4//4\n"}
shapes = {n: {"type": n} for n in ("rectangle", "disk", "cube")}
shapes["sphere"] = {"type": "sphere", "center": [0.1, 0.2, -0.1], "radius": 0.8}
shapes["cylinder"] = {"type": "cylinder", "p0": [0.1, -0.4, -0.5], "p1": [0.3, 0.2, 0.7], "radius": 0.6}
folder = tempfile.mkdtemp()
for name, text in files.items():
    open(f"{folder}/{name}.obj", "w").write(text)
    shapes[name] = {"type": "obj", "filename": f"{folder}/{name}.obj", "flip_tex_coords": False,
                    "face_normals": name == "faceted"}
for name, shape in sorted(shapes.items()):
    for flip in (0, 1):
        for mirror in (0, 1, 4):
            axis = rng.normal(size=3); axis /= np.linalg.norm(axis)
            s = np.array([-1.0 if mirror >> k & 1 else 1.0 for k in range(3)]) * rng.uniform(0.5, 2)
            if name not in ("sphere", "cylinder"):
                s *= rng.uniform(0.5, 2, size=3)
            T = mi.ScalarTransform4f
            m = T().translate(list(rng.uniform(-1, 1, 3))) @ T().rotate(list(axis), rng.uniform(0, 360)) @ T().scale(list(s))
            scene = mi.load_dict({"type": "scene", "s": dict(shape, to_world=m, flip_normals=bool(flip))})
            found = 0
            while found < rays:
                target = m @ mi.ScalarPoint3f(list(rng.uniform(-0.9, 0.9, 3)))
                o = np.float32(rng.normal(size=3) * 3)
                d = np.float32((np.array(target) - o) * rng.uniform(0.2, 2))
                unit = d / np.linalg.norm(d)
                si = scene.ray_intersect(mi.Ray3f(list(o), list(d)))
                if not si.is_valid() or si.t < 1e-3:
                    continue
                found += 1
                rows = np.array(m.matrix)[:3].ravel()
                uv, n, du = np.array(si.uv), np.array(si.sh_frame.n), np.array(si.dp_du)
                print(name, flip, mirror, *(f"{x:.8g}" for x in [*rows, *o, *d]), *(f"{x:.5g}" for x in [si.t, *uv, *n, *du]))
