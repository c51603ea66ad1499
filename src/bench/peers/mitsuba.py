"""Renders a scene by Mitsuba 3; `common.py` goes before it."""


def image_of(mi, np, scene, integrator, sensor, spp, seed):
    image = np.array(mi.render(scene, integrator=integrator, sensor=sensor, spp=spp, seed=seed), dtype=np.float32)
    return np.repeat(image, 3, axis=2) if image.shape[2] < 3 else image[..., :3]


def main():
    setup = json.loads(sys.stdin.readline())
    import numpy as np
    try:
        import mitsuba as mi
    except ImportError as error:
        return without("mitsuba", error)
    if setup["variant"] not in mi.variants():
        return answer(error=f"Mitsuba has no variant `{setup['variant']}` (it has {', '.join(mi.variants())})")
    mi.set_variant(setup["variant"])
    mi.set_log_level(mi.LogLevel.Error)
    import drjit as dr
    dr.set_thread_count(setup["threads"])
    scene = mi.load_file(setup["scene"], **setup["define"])
    limits = {"max_depth": setup["max_depth"], "rr_depth": setup["rr_depth"], "hide_emitters": setup["hide_emitters"]}
    integrator = mi.load_dict({"type": setup["integrator"], **limits})
    sensor = scene.sensors()[0]
    if list(sensor.film().size()) != setup["size"] and list(sensor.film().crop_size()) != setup["size"]:
        parameters = mi.traverse(sensor)
        parameters["film.size"] = setup["size"]
        parameters.update()
    render = lambda spp, seed: image_of(mi, np, scene, integrator, sensor, spp, seed)
    # Kernels are compiled at their first use, which is no part of rendering.
    shape = [render(spp, 0).shape for spp in (1, 2)][0]
    if list(shape[:2]) != setup["size"][::-1]:
        return answer(error=f"Mitsuba's image has {shape[1]} × {shape[0]} pixels instead of {setup['size'][0]} × {setup['size'][1]}")
    answer(ready=True, version=mi.__version__)
    for line in iter(sys.stdin.readline, ""):
        job = json.loads(line)

        def piece(spp, samples):
            start = time.perf_counter()
            image = render(spp, (job["seed"] + 7919 * samples) % 2**32)
            return image, time.perf_counter() - start

        run_pieces(job, piece, max(1, 4_000_000 // (shape[0] * shape[1])))


serve(main)
