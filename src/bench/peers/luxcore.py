"""Renders a scene by LuxCore; `common.py` and `translate.py` go before it."""

# Stands for no limit: without roulette every vertex of one walk is joined with every one of the other.
DEEPEST = {"BIDIRCPU": 24, "PATHCPU": 100}


class Translation:
    """Properties of LuxCore's scene; it notes what is only similar."""

    def __init__(self, lux):
        self.scene, self.lux, self.lines, self.similar, self.count = lux.Scene(), lux, {}, [], 0

    def put(self, prefix, **values):
        for key, value in values.items():
            value = value if isinstance(value, (str, bool, int, float)) else [float(x) for x in value]
            self.lines[f"{prefix}.{key.replace('__', '.')}"] = value

    def name(self):
        self.count += 1
        return f"n{self.count}"

    def close_to(self, what):
        if what not in self.similar:
            self.similar.append(what)

    def parse(self):
        properties = self.lux.Properties()
        for key, value in self.lines.items():
            properties.Set(self.lux.Property(key, value))
        self.scene.Parse(properties)
        self.lines = {}

    def colour(self, value):
        """Three numbers, or the name of a texture."""
        if not isinstance(value, dict):
            return value
        name, image = self.name(), self.name()
        prefix, (su, sv), (du, dv) = f"scene.textures.{name}", value["scale"], value["offset"]
        if value["type"] == "checkerboard":
            # LuxCore's squares have the side 1, those of Mitsuba 1/2.
            su, sv, du, dv = 2 * su, 2 * sv, 2 * du, 2 * dv
            self.put(prefix, type="checkerboard2d", texture1=value["colors"][0], texture2=value["colors"][1])
        else:
            # Decoded here, because LuxCore takes a power of 2.2 for sRGB.
            pixels = png_pixels(value["file"])
            if pixels is None:
                self.close_to("images that are no PNG: gamma 2.2 instead of sRGB")
                self.put(prefix, type="imagemap", file=value["file"], gamma=1.0 if value["raw"] else 2.2)
            else:
                colours = pixels.shape[2] - (pixels.shape[2] + 1) % 2
                pixels = pixels[..., :colours] if value["raw"] else srgb_to_linear(pixels[..., :colours])
                h, w = pixels.shape[:2]
                self.scene.DefineImageMap(image, np.ascontiguousarray(pixels, np.float32), 1.0, colours, w, h)
                self.put(prefix, type="imagemap", file=image, gamma=1.0)
            if value["wrap"] not in ("repeat", "clamp"):
                raise ValueError(f"the wrap mode `{value['wrap']}` is not known to this peer")
            if value["filter"] != "bilinear":
                self.close_to("texture filter `nearest` as bilinear")
            self.put(prefix, wrap=value["wrap"])
        self.put(prefix, mapping__type="uvmapping2d", mapping__uvscale=(su, sv), mapping__uvdelta=(du, dv))
        return name

    def scaled(self, value, factor):
        if not isinstance(value, dict):
            return value * factor
        name = self.name()
        self.put(f"scene.textures.{name}", type="scale", texture1=self.colour(value), texture2=np.ones(3) * factor)
        return name

    def number(self, value):
        value = self.colour(value)
        return value if isinstance(value, str) else float(np.mean(value))

    def one_sided(self, name):
        """What is opaque in Mitsuba is black from behind."""
        black, both = self.name(), self.name()
        self.put(f"scene.materials.{black}", type="matte", kd=(0, 0, 0))
        self.put(f"scene.materials.{both}", type="twosided", frontmaterial=name, backmaterial=black)
        return both

    def roughness(self, bsdf):
        # LuxCore's roughness is the alpha of GGX: its distribution has u · v where GGX has alpha².
        if bsdf["distribution"] != "ggx":
            self.close_to(f"{bsdf['distribution']} as ggx")
        self.close_to(f"{bsdf['type']}: masking after Schlick instead of Smith")
        return {"uroughness": bsdf["alpha_u"], "vroughness": bsdf["alpha_v"]}

    def material(self, bsdf, two_sided=False):
        """The name of the material; a nested one of `twosided` does not get a black back."""
        name, kind = self.name(), bsdf["type"]
        prefix = f"scene.materials.{name}"
        opaque = kind in ("diffuse", "conductor", "roughconductor", "plastic", "roughplastic")
        if kind == "diffuse":
            self.put(prefix, type="matte", kd=self.colour(bsdf["reflectance"]))
        elif "dielectric" in kind:
            kinds = {"dielectric": "glass", "roughdielectric": "roughglass", "thindielectric": "archglass"}
            self.put(prefix, type=kinds[kind], kr=self.colour(bsdf["reflectance"]), kt=self.colour(bsdf["transmittance"]),
                     interiorior=bsdf["int_ior"], exteriorior=bsdf["ext_ior"])
            if kind == "roughdielectric":
                self.put(prefix, **self.roughness(bsdf))
            elif kind == "thindielectric":
                self.close_to("thindielectric as archglass")
        elif kind == "conductor":
            kr = self.colour(bsdf["reflectance"])
            if bsdf["eta"] is not None:
                # A smooth metal is to be found by reflections alone; LuxCore's only mirror has one colour.
                self.close_to("conductor: reflectance at normal incidence for all angles")
                kr = kr * ((bsdf["eta"] - 1) ** 2 + bsdf["k"] ** 2) / ((bsdf["eta"] + 1) ** 2 + bsdf["k"] ** 2)
            self.put(prefix, type="mirror", kr=kr)
        elif kind == "roughconductor":
            if isinstance(bsdf["reflectance"], dict) or (bsdf["reflectance"] != 1).any():
                raise ValueError(f"`specular_reflectance` of a {kind} is not known to this peer")
            # The perfect mirror is approached by a large k.
            eta, k = (np.ones(3), np.full(3, 1e3)) if bsdf["eta"] is None else (bsdf["eta"], bsdf["k"])
            self.put(prefix, type="metal2", n=eta, k=k, **self.roughness(bsdf))
        elif kind in ("plastic", "roughplastic"):
            self.close_to(f"{kind} as glossy2")
            rough = {"uroughness": 0.01, "vroughness": 0.01} if kind == "plastic" else self.roughness(bsdf)
            eta = bsdf["int_ior"] / bsdf["ext_ior"]
            # Of its base glossy2 shows about what Mitsuba's does under a smooth coat, however rough it is.
            factor = base_of(bsdf) / base_share({**bsdf, "alpha_u": 1e-3})[0]
            self.put(prefix, type="glossy2", kd=self.scaled(bsdf["diffuse"], factor), ks=self.colour(bsdf["reflectance"]),
                     index=eta, multibounce=False, **rough)
        elif kind == "twosided":
            front, back = (self.material(side, True) for side in (bsdf["sides"] * 2)[:2])
            self.put(prefix, type="twosided", frontmaterial=front, backmaterial=back)
        elif kind == "blendbsdf":
            first, second = (self.material(side, two_sided) for side in bsdf["sides"])
            self.put(prefix, type="mix", material1=first, material2=second, amount=self.number(bsdf["weight"]))
        elif kind == "mask":
            name = self.material(bsdf["sides"][0], two_sided)
            self.put(f"scene.materials.{name}", transparency=self.number(bsdf["opacity"]))
        elif kind == "null":
            self.put(prefix, type="null")
        return self.one_sided(name) if opaque and not two_sided and not is_black(bsdf) else name

    def mesh(self, mesh, materials):
        # Many shapes share a model; an emitter has its own.
        key = mesh["bsdf"]["id"] if mesh["radiance"] is None else None
        material = materials.get(key) if key else None
        if material is None:
            material = self.material(mesh["bsdf"])
            materials[key] = material
        if mesh["radiance"] is not None:
            self.put(f"scene.materials.{material}", emission=mesh["radiance"])
        name, floats = self.name(), lambda x: None if x is None else np.ascontiguousarray(x, np.float32)
        uvs = None if mesh["uvs"] is None else [floats(mesh["uvs"])]
        self.scene.DefineMeshExt(name, floats(mesh["points"]), np.ascontiguousarray(mesh["triangles"], np.uint32),
                                 floats(mesh["normals"]), uvs)
        self.put(f"scene.objects.{name}", material=material, ply=name)

    def light(self, light):
        name = self.name()
        prefix, kind = f"scene.lights.{name}", light["type"]
        if kind == "constant":
            self.put(prefix, type="constantinfinite", color=light["radiance"])
        elif kind == "point":
            # Its colour is that of the power.
            self.put(prefix, type="point", position=light["position"], color=4 * math.pi * light["intensity"])
        elif kind == "directional":
            self.put(prefix, type="sharpdistant", direction=light["direction"], color=light["irradiance"])
            if light["diameter"]:
                # The disk of a sun is given by half its angle and its radiance.
                half = math.radians(light["diameter"] / 2)
                self.put(prefix, type="distant", theta=math.degrees(half),
                         color=light["irradiance"] / (2 * math.pi * (1 - math.cos(half))))
        elif kind == "spot":
            # LuxCore's own spot fades by another rule, so that the cone is an image whose upper edge is the axis.
            rows = 1 << 14
            angle = (np.arange(rows) + 0.5) / rows * 180
            fade = np.clip((light["cutoff"] - angle) / (light["cutoff"] - light["beam"]), 0, 1)
            # LuxCore divides by 16 π² times the mean over all directions.
            mean = (fade * np.sin(np.radians(angle))).mean() * math.pi / 2
            self.scene.DefineImageMap(name, np.repeat(fade, 2).astype(np.float32), 1.0, 1, 2, rows)
            place = np.eye(4)
            place[:3, :3], place[:3, 3] = frame_of(light["direction"]), light["position"]
            self.put(prefix, type="mappoint", mapfile=name, gamma=1.0, color=16 * math.pi**2 * mean * light["intensity"],
                     position=(0, 0, 0), transformation=place.T.ravel())

    def camera(self, camera, size):
        # The window is that of a plane at the distance 1 / tan(fov / 2), moved by the one pixel by which LuxCore's
        # images lie too low.
        high, pixel = size[1] / size[0], 2 / size[0]
        self.put("scene.camera", type="perspective", lookat__orig=camera["origin"],
                 lookat__target=camera["origin"] + camera["ahead"], up=camera["up"],
                 fieldofview=math.degrees(camera["fov_x"]), screenwindow=(-1, 1, -high - pixel, high - pixel),
                 cliphither=camera["near"], clipyon=camera["far"], lensradius=camera["radius"],
                 focaldistance=camera["focus"], autofocus__enable=False, autovolume__enable=False)


def configuration(lux, setup, seed):
    deepest = setup["max_depth"] if setup["max_depth"] > 0 else DEEPEST[setup["engine"]]
    values = {
        "renderengine.type": setup["engine"], "renderengine.seed": 1 + seed % 2**31,
        "native.threads.count": setup["threads"],
        # No adaptive sampling; the same weight for all samples of a pixel.
        "sampler.type": "SOBOL", "sampler.sobol.adaptive.strength": 0.0, "film.filter.type": "NONE",
        "film.width": setup["size"][0], "film.height": setup["size"][1],
        # Radiance as it is.
        "film.imagepipelines.0.0.type": "NOP", "film.outputs.0.type": "RGB_IMAGEPIPELINE", "film.outputs.0.index": 0,
        "film.outputs.0.filename": "unused.exr",
        # Every triangle of a lamp is a light, and the default would count them.
        "lightstrategy.type": "POWER",
    }
    if setup["engine"] == "BIDIRCPU":
        # Its weights leave out the probabilities of roulette, which makes images too bright: no roulette. A walk from
        # the light ends one vertex earlier: joined with the sensor itself, it has as many edges as one from there.
        values.update({"path.maxdepth": deepest, "light.maxdepth": max(1, deepest - 1), "path.russianroulette.depth": 100})
    else:
        values.update({f"path.pathdepth.{kind}": deepest for kind in ("total", "diffuse", "glossy", "specular")})
        values.update({"path.russianroulette.depth": setup["rr_depth"]})
    properties = lux.Properties()
    for key, value in values.items():
        properties.Set(lux.Property(key, value))
    return properties


def run(job, lux, setup, scene):
    """To every mark, in one session that is not interrupted: reading the film belongs to its time."""
    width, height = setup["size"]
    image = np.zeros((height, width, 3), np.float32)
    session = lux.RenderSession(lux.RenderConfig(configuration(lux, setup, job["seed"]), scene))
    session.Start()
    start = time.perf_counter()

    def samples():
        session.UpdateStats()
        return session.GetStats().Get("stats.renderengine.total.samplecount").GetFloat() / (width * height)

    seconds = done = 0.0
    for mark in job["marks"]:
        # A mark that passed while there was no whole sample yet, or an image was read, has that of the mark before.
        if mark.get("seconds", math.inf) <= seconds or mark.get("samples", math.inf) <= done:
            continue
        while True:
            seconds, done = time.perf_counter() - start, samples()
            left = mark["seconds"] - seconds if "seconds" in mark else (mark["samples"] - done) * seconds / max(done, 0.1)
            if left <= 0 and done >= 1:
                break
            time.sleep(min(max(left, 0.001), 0.1))
        session.GetFilm().GetOutputFloat(lux.FilmOutputType.RGB_IMAGEPIPELINE, image, 0)
        seconds = time.perf_counter() - start
        # LuxCore's first row is the lowest.
        tell_image(job, image[::-1], seconds=seconds, samples=round(done))
    session.Stop()
    tell_end()


def main():
    setup = json.loads(sys.stdin.readline())
    try:
        import pyluxcore as lux
    except ImportError as error:
        return without("pyluxcore", error)
    lux.Init(lambda message: None)
    if setup["hide_emitters"]:
        return answer(error="`hide_emitters` is not known to this peer")
    scene = read_scene(setup["scene"], setup["define"])
    translation, materials = Translation(lux), {}
    translation.camera(scene["camera"], setup["size"])
    if scene["camera"]["filter"] != "box":
        translation.close_to(f"the filter `{scene['camera']['filter']}` as a box")
    for mesh in scene["meshes"]:
        translation.mesh(mesh, materials)
    for light in scene["lights"]:
        translation.light(light)
    translation.parse()
    if setup["max_depth"] < 0:
        translation.close_to(f"no limit of path length as {DEEPEST[setup['engine']]}")
    elif setup["engine"] == "BIDIRCPU":
        translation.close_to("of paths longer than `max_depth`, those that are joined from two shorter walks are seen")
    answer(ready=True, version=lux.Version(), approximations=translation.similar)
    for line in iter(sys.stdin.readline, ""):
        run(json.loads(line), lux, setup, translation.scene)


serve(main)
# Its own clearing up ends in a crash.
os._exit(0)
