"""Renders a scene by Blender's Cycles; `common.py` and `translate.py` go before it."""
import re, tempfile

# Stands for no limit of path length.
DEEPEST = 1024


class Translation:
    """Fills Blender's scene; it notes what is only similar."""

    def __init__(self, bpy, manifolds):
        self.bpy, self.manifolds, self.similar, self.materials, self.images = bpy, manifolds, [], {}, {}

    def close_to(self, what):
        if what not in self.similar:
            self.similar.append(what)

    # Shaders. A value of an input is a number, a colour, or the output of another node.

    def node(self, tree, kind, inputs=(), **properties):
        node = tree.nodes.new(kind)
        for key, value in properties.items():
            setattr(node, key, value)
        for key, value in dict(inputs).items():
            if value is None:
                continue
            if isinstance(value, self.bpy.types.NodeSocket):
                tree.links.new(value, node.inputs[key])
            elif isinstance(value, (int, float)):
                node.inputs[key].default_value = value
            else:
                value = [float(x) for x in value]
                node.inputs[key].default_value = value + [1.0] * (len(node.inputs[key].default_value) - len(value))
        return node.outputs[0]

    def colour(self, tree, value):
        if not isinstance(value, dict):
            return value
        # Blender's images stand on their lower edge, the coordinates of the scene hang from the upper one.
        (su, sv), (du, dv) = value["scale"], value["offset"]
        uv = self.node(tree, "ShaderNodeUVMap", uv_map="uv")
        uv = self.node(tree, "ShaderNodeMapping", {"Vector": uv, "Scale": (su, -sv, 1), "Location": (du, 1 - dv, 0.25)})
        if value["type"] == "checkerboard":
            # Scaled by two, since Mitsuba's squares have the side 1/2; the edge that v hangs from has even parity.
            return self.node(tree, "ShaderNodeTexChecker", {"Vector": uv, "Scale": 2.0, "Color1": value["colors"][0],
                                                            "Color2": value["colors"][1]})
        image = self.images.get((value["file"], value["raw"]))
        if image is None:
            image = self.images[value["file"], value["raw"]] = self.bpy.data.images.load(value["file"])
            image.colorspace_settings.name = "Non-Color" if value["raw"] else "sRGB"
        extension = {"repeat": "REPEAT", "clamp": "EXTEND", "mirror": "MIRROR"}[value["wrap"]]
        filter = {"bilinear": "Linear", "nearest": "Closest"}[value["filter"]]
        return self.node(tree, "ShaderNodeTexImage", {"Vector": uv}, image=image, extension=extension, interpolation=filter)

    def scaled(self, tree, value, factor):
        if not isinstance(value, dict):
            return value * factor
        return self.node(tree, "ShaderNodeVectorMath", {0: self.colour(tree, value), 1: np.ones(3) * factor},
                         operation="MULTIPLY")

    def weight(self, tree, value):
        return self.colour(tree, value) if isinstance(value, dict) else float(np.mean(value))

    def backfacing(self, tree):
        return self.node(tree, "ShaderNodeNewGeometry").node.outputs["Backfacing"]

    def roughness(self, bsdf):
        # Cycles squares its roughness to get alpha.
        au, av = bsdf["alpha_u"], bsdf["alpha_v"]
        if au != av:
            raise ValueError(f"`alpha_u` unlike `alpha_v` of a {bsdf['type']} is not known to this peer")
        return au ** 0.5, {"ggx": "GGX", "beckmann": "BECKMANN"}[bsdf["distribution"]]

    def shader(self, tree, bsdf, one_sided=True):
        """The output of a local model; what is opaque in Mitsuba is black from behind."""
        kind = bsdf["type"]
        rough, distribution = self.roughness(bsdf) if kind.startswith("rough") else (0.0, "GGX")
        opaque = kind in ("diffuse", "conductor", "roughconductor", "plastic", "roughplastic")
        if kind == "diffuse":
            made = self.node(tree, "ShaderNodeBsdfDiffuse", {"Color": self.colour(tree, bsdf["reflectance"])})
        elif kind in ("dielectric", "roughdielectric"):
            kr, kt, ior = bsdf["reflectance"], bsdf["transmittance"], bsdf["int_ior"] / bsdf["ext_ior"]
            if not isinstance(kr, dict) and not isinstance(kt, dict) and (kr == kt).all():
                made = self.node(tree, "ShaderNodeBsdfGlass", {"Color": kr, "Roughness": rough, "IOR": ior},
                                 distribution=distribution)
            else:
                # Blender's glass has one colour for both.
                if rough:
                    self.close_to("tinted roughdielectric: reflection by the angle to the surface, not to its facets")
                inputs = {"Roughness": rough}
                through = self.node(tree, "ShaderNodeBsdfRefraction", {**inputs, "Color": self.colour(tree, kt), "IOR": ior},
                                    distribution=distribution)
                back = self.node(tree, "ShaderNodeBsdfGlossy", {**inputs, "Color": self.colour(tree, kr)},
                                 distribution=distribution)
                share = self.node(tree, "ShaderNodeFresnel", {"IOR": ior})
                made = self.node(tree, "ShaderNodeMixShader", {0: share, 1: through, 2: back})
        elif kind in ("conductor", "roughconductor") and bsdf["eta"] is None:
            colour = self.colour(tree, bsdf["reflectance"])
            made = self.node(tree, "ShaderNodeBsdfGlossy", {"Color": colour, "Roughness": rough}, distribution=distribution)
        elif kind in ("conductor", "roughconductor"):
            if isinstance(bsdf["reflectance"], dict) or (bsdf["reflectance"] != 1).any():
                raise ValueError(f"`specular_reflectance` of a {kind} is not known to this peer")
            inputs = {"IOR": bsdf["eta"], "Extinction": bsdf["k"], "Roughness": rough}
            made = self.node(tree, "ShaderNodeBsdfMetallic", inputs, fresnel_type="PHYSICAL_CONDUCTOR",
                             distribution=distribution)
        elif kind in ("plastic", "roughplastic"):
            self.close_to(f"{kind} as principled")
            if distribution != "GGX":
                self.close_to(f"{kind}: beckmann as ggx")
            factor = base_of(bsdf) / base_share({**bsdf, "alpha_u": 1e-3})[0]
            made = self.node(tree, "ShaderNodeBsdfPrincipled", {
                "Base Color": self.scaled(tree, bsdf["diffuse"], factor), "Roughness": rough,
                "IOR": bsdf["int_ior"] / bsdf["ext_ior"], "Specular Tint": self.colour(tree, bsdf["reflectance"])},
                distribution="GGX")
        elif kind == "twosided":
            front, back = ([self.shader(tree, side, False) for side in bsdf["sides"]] * 2)[:2]
            if len(bsdf["sides"]) == 1:
                return front
            return self.node(tree, "ShaderNodeMixShader", {0: self.backfacing(tree), 1: front, 2: back})
        elif kind == "blendbsdf":
            first, second = (self.shader(tree, side, one_sided) for side in bsdf["sides"])
            return self.node(tree, "ShaderNodeMixShader", {0: self.weight(tree, bsdf["weight"]), 1: first, 2: second})
        elif kind in ("mask", "null"):
            clear = self.node(tree, "ShaderNodeBsdfTransparent")
            if kind == "null":
                return clear
            solid = self.shader(tree, bsdf["sides"][0], one_sided)
            return self.node(tree, "ShaderNodeMixShader", {0: self.weight(tree, bsdf["opacity"]), 1: clear, 2: solid})
        else:
            raise ValueError(f"the local model `{kind}` is not known to this peer")
        return self.front(tree, made) if opaque and one_sided else made

    def front(self, tree, shader):
        return self.node(tree, "ShaderNodeMixShader", {0: self.backfacing(tree), 1: shader})

    def material(self, mesh):
        # Many shapes share a model. The backs of spheres are not seen.
        bsdf, radiance, closed = mesh["bsdf"], mesh["radiance"], mesh["sphere"] is not None
        key = (bsdf["id"], closed)
        if radiance is None and bsdf["id"] and key in self.materials:
            return self.materials[key]
        material = self.materials[key] = self.bpy.data.materials.new(mesh["name"])
        material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        made = None if radiance is not None and is_black(bsdf) else self.shader(tree, bsdf, not closed)
        if radiance is not None:
            light = self.emission(tree, radiance)
            light = light if closed else self.front(tree, light)
            made = light if made is None else self.node(tree, "ShaderNodeAddShader", {0: light, 1: made})
            material.cycles.emission_sampling = "FRONT"
        self.node_output(tree, "ShaderNodeOutputMaterial", made)
        return material

    def emission(self, tree, radiance, kind="ShaderNodeEmission", factor=1.0):
        # Colours are best in [0, 1].
        most = max(float(np.max(radiance)), 1e-30)
        return self.node(tree, kind, {"Color": radiance / most, "Strength": most * factor})

    def node_output(self, tree, kind, shader):
        tree.links.new(shader, tree.nodes.new(kind).inputs["Surface"])

    # Objects.

    def place(self, name, data, axes=np.eye(3), origin=(0, 0, 0)):
        """An object whose axes are the columns."""
        from mathutils import Matrix
        thing = self.bpy.data.objects.new(name, data)
        thing.matrix_world = Matrix([[*map(float, row), float(x)] for row, x in zip(axes, origin)] + [[0, 0, 0, 1]])
        self.bpy.context.scene.collection.objects.link(thing)
        return thing

    def mesh(self, mesh):
        if self.manifolds and mesh["radiance"] is not None and self.lamp(mesh):
            return
        p, t = mesh["points"], mesh["triangles"]
        data = self.bpy.data.meshes.new(mesh["name"])
        data.vertices.add(len(p))
        data.vertices.foreach_set("co", p.astype(np.float32).ravel())
        data.loops.add(3 * len(t))
        data.loops.foreach_set("vertex_index", t.astype(np.int32).ravel())
        data.polygons.add(len(t))
        data.polygons.foreach_set("loop_start", np.arange(0, 3 * len(t), 3, dtype=np.int32))
        if mesh["uvs"] is not None:
            data.uv_layers.new(name="uv").data.foreach_set("uv", mesh["uvs"][t].astype(np.float32).ravel())
        data.update(calc_edges=True)
        if mesh["normals"] is None:
            data.shade_flat()
        else:
            # As they are: the usual way stores them in 16 bits.
            data.shade_smooth()
            normals = data.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT")
            normals.data.foreach_set("vector", mesh["normals"].astype(np.float32).ravel())
        data.materials.append(self.material(mesh))
        thing = self.place(mesh["name"], data)
        # It would move the ends of shadow rays.
        thing.cycles.shadow_terminator_geometry_offset = 0.0
        if self.manifolds:
            # Through rough glass manifold walks lose light that paths find.
            clear = mesh["bsdf"]["type"] == "dielectric"
            thing.cycles.is_caustics_caster, thing.cycles.is_caustics_receiver = clear, not clear

    def lamp(self, mesh):
        """An emitter as a light object, to which alone manifold walks lead; false where it has no such shape.

        The sun of a pool is a sphere far away. It becomes a point light with its radius and radiance.
        """
        black, p, t = is_black(mesh["bsdf"]), mesh["points"], mesh["triangles"]
        x, y = self.sides(p)
        if mesh["sphere"] is not None and black:
            centre, radius = mesh["sphere"]
            data = self.bpy.data.lights.new(mesh["name"], "POINT")
            data.shadow_soft_size, data.use_soft_falloff = radius, False
            thing, power = self.place(mesh["name"], data, origin=centre), 4 * math.pi**2 * radius**2
        elif black and len(p) == 4 and len(t) == 2 and abs(x @ y) < 1e-4 * (x @ x) and abs(
                area_of(p, t) / (4 * np.linalg.norm(np.cross(x, y))) - 1) < 1e-4:
            normal = np.cross(p[t[0, 1]] - p[t[0, 0]], p[t[0, 2]] - p[t[0, 0]])
            width, height, z = 2 * np.linalg.norm(x), 2 * np.linalg.norm(y), -normal / np.linalg.norm(normal)
            data = self.bpy.data.lights.new(mesh["name"], "AREA")
            data.shape, data.size, data.size_y = "RECTANGLE", width, height
            # It shines along its −z.
            axes = np.stack([2 * x / width, np.cross(z, 2 * x / width), z], 1)
            thing, power = self.place(mesh["name"], data, axes, p.mean(0)), math.pi * width * height
        else:
            self.close_to("emitters other than black spheres and rectangles are meshes, which manifold walks do not find")
            return False
        self.close_to("emitters that are light objects do not cast shadows")
        self.shine(data, mesh["radiance"], power)
        thing.visible_camera = True
        return True

    def sides(self, p):
        """Half of the sides of a rectangle, its corners in any order."""
        d = p[1:] - p[0]
        d = d[np.argsort(np.linalg.norm(d, axis=1))]
        return d[0] / 2, d[1] / 2

    def shine(self, data, colour, power):
        most = max(float(np.max(colour)), 1e-30)
        data.color, data.energy = [float(x) for x in colour / most], float(most * power)
        data.cycles.is_caustics_light = self.manifolds

    def light(self, light):
        kind = light["type"]
        if kind == "constant":
            world = self.bpy.context.scene.world = self.bpy.data.worlds.new("sky")
            world.use_nodes = True
            world.node_tree.nodes.clear()
            self.node_output(world.node_tree, "ShaderNodeOutputWorld",
                             self.emission(world.node_tree, light["radiance"], "ShaderNodeBackground"))
        elif kind in ("point", "spot"):
            data = self.bpy.data.lights.new(kind, "POINT")
            data.shadow_soft_size = 0.0
            self.shine(data, light["intensity"], 4 * math.pi)
            self.place(kind, data, frame_of(light.get("direction", np.array([0.0, 0, 1]))), light["position"])
            if kind == "spot":
                self.cone(data, light)
        elif kind == "directional":
            data = self.bpy.data.lights.new(kind, "SUN")
            data.angle = math.radians(light["diameter"])
            self.shine(data, light["irradiance"], 1.0)
            # It shines along its −z.
            self.place(kind, data, frame_of(-light["direction"]))
        else:
            raise ValueError(f"the emitter `{kind}` is not known to this peer")

    def cone(self, data, light):
        """Blender's own spot fades by another rule."""
        data.use_nodes = True
        tree = data.node_tree
        tree.nodes.clear()
        normal = self.node(tree, "ShaderNodeTexCoord").node.outputs["Normal"]
        cos = self.node(tree, "ShaderNodeSeparateXYZ", {0: normal}).node.outputs["Z"]
        angle = self.node(tree, "ShaderNodeMath", {0: cos}, operation="ARCCOSINE")
        fade = self.node(tree, "ShaderNodeMapRange", {
            "Value": angle, "From Min": math.radians(light["beam"]), "From Max": math.radians(light["cutoff"]),
            "To Min": 1.0, "To Max": 0.0}, clamp=True)
        self.node_output(tree, "ShaderNodeOutputLight", self.node(tree, "ShaderNodeEmission", {"Strength": fade}))

    def camera(self, camera):
        data = self.bpy.data.cameras.new("camera")
        data.sensor_fit, data.angle = "HORIZONTAL", camera["fov_x"]
        data.clip_start, data.clip_end = camera["near"], camera["far"]
        if camera["radius"]:
            data.dof.use_dof, data.dof.focus_distance = True, camera["focus"]
            data.dof.aperture_fstop = data.lens * 1e-3 / (2 * camera["radius"])
        # It looks along its −z.
        axes = np.stack([np.cross(camera["ahead"], camera["up"]), camera["up"], -camera["ahead"]], 1)
        self.bpy.context.scene.camera = self.place("camera", data, axes, camera["origin"])


def configure(scene, setup):
    """Everything that makes Cycles biased or adaptive is off."""
    deepest = setup["max_depth"] if setup["max_depth"] > 0 else DEEPEST
    scene.render.engine = "CYCLES"
    values = {
        "device": "CPU", "use_adaptive_sampling": False, "use_denoising": False, "use_guiding": False, "use_fast_gi": False,
        "blur_glossy": 0.0, "sample_clamp_direct": 0.0, "sample_clamp_indirect": 0.0, "caustics_reflective": True,
        "caustics_refractive": True, "pixel_filter_type": "BOX", "filter_width": 1.0, "sampling_pattern": "TABULATED_SOBOL",
        # Direct light is bounce 0, which is two edges.
        "max_bounces": max(0, deepest - 2), "transparent_max_bounces": deepest, "use_auto_tile": False,
        # Pieces of one sequence.
        "use_sample_subset": True, "samples": 1 << 24,
    }
    values.update({f"{kind}_bounces": deepest for kind in ("diffuse", "glossy", "transmission")})
    for key, value in values.items():
        setattr(scene.cycles, key, value)
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = *setup["size"], 100
    render.threads_mode, render.threads = "FIXED", setup["threads"]
    # What was loaded is kept between two pieces.
    render.use_persistent_data, render.use_file_extension = True, False
    render.image_settings.file_format, render.image_settings.color_mode = "OPEN_EXR", "RGB"
    render.image_settings.color_depth, render.image_settings.exr_codec = "32", "NONE"
    scene.view_settings.view_transform = "Raw"


def render_piece(bpy, file, spp, offset, seed):
    """Pixels, lowest row first, and the seconds that Cycles took without loading. The file is made, and left."""
    scene = bpy.context.scene
    scene.render.filepath = file
    scene.cycles.seed, scene.cycles.sample_offset, scene.cycles.sample_subset_length = seed, offset, spp
    bpy.ops.render.render(write_still=True)
    # The time stands in the head of the file, as hours, minutes and seconds.
    with open(file, "rb") as head:
        told = re.search(rb"cycles\.[^\0]*\.render_time\0string\0....([0-9:.]+)", head.read(1 << 16), re.DOTALL)
    seconds = sum(float(part) * 60**i for i, part in enumerate(reversed(told.group(1).split(b":"))))
    image = bpy.data.images.load(file)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    size = image.size[1], image.size[0], image.channels
    bpy.data.images.remove(image)
    return pixels.reshape(size)[..., :3], seconds


def main():
    setup = json.loads(sys.stdin.readline())
    try:
        import bpy
    except ImportError as error:
        return without("bpy", error)
    if setup["hide_emitters"]:
        return answer(error="`hide_emitters` is not known to this peer")
    scene = read_scene(setup["scene"], setup["define"])
    bpy.ops.wm.read_factory_settings(use_empty=True)
    configure(bpy.context.scene, setup)
    translation = Translation(bpy, setup["integrator"] == "mnee")
    translation.camera(scene["camera"])
    if scene["camera"]["filter"] != "box":
        translation.close_to(f"the filter `{scene['camera']['filter']}` as a box")
    for mesh in scene["meshes"]:
        translation.mesh(mesh)
    for light in scene["lights"]:
        translation.light(light)
    # Trees are built by the first render, which is no part of rendering.
    with tempfile.TemporaryDirectory() as folder:
        render_piece(bpy, os.path.join(folder, "image.exr"), 1, 0, 0)
    answer(ready=True, version=bpy.app.version_string, approximations=translation.similar)
    for line in iter(sys.stdin.readline, ""):
        job = json.loads(line)

        def piece(spp, samples):
            image, took = render_piece(bpy, job["file"] + ".exr", spp, samples, job["seed"] % 2**31)
            # Blender's first row is the lowest, and its seconds have two digits after the point.
            return image[::-1], took + 0.005

        run_pieces(job, piece, max(1, 16_000_000 // (setup["size"][0] * setup["size"][1])), cautious=True)


# Blender looks for modules by names as common as `cycles`, which must not be found in the working directory.
sys.path = [path for path in sys.path if path]
serve(main)
