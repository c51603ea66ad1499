"""Renders a scene by Mitsuba 3, as a child of `nephroid bench`.

The job is one line of JSON on standard input, then one line per run. Every answer is one line of JSON.
Images are written as raw 32 bit floats, three per pixel, to the file that the run names.
"""
import json, os, resource, sys, time


def answer(**what):
    print(json.dumps(what), file=channel, flush=True)


def image_of(mi, np, scene, integrator, sensor, spp, seed):
    image = np.array(mi.render(scene, integrator=integrator, sensor=sensor, spp=spp, seed=seed), dtype=np.float32)
    return np.repeat(image, 3, axis=2) if image.shape[2] < 3 else image[..., :3]


def run(job, render, pixels):
    """To every mark, in pieces that end there; their mean is weighted by samples."""
    total, samples, seconds, told = None, 0, 0.0, 0
    rate = job.get("rate") or 1.0
    most = max(1, 4_000_000 // pixels)
    for mark in job["marks"]:
        while True:
            left = mark["samples"] - samples if "samples" in mark else (mark["seconds"] - seconds) * rate
            if left <= 0 or ("seconds" in mark and samples and left < 0.5):
                break
            spp = max(1, min(round(left), most))
            start = time.perf_counter()
            image = render(spp, (job["seed"] + 7919 * samples) % 2**32).astype("float64")
            seconds += time.perf_counter() - start
            total = image * spp if total is None else total + image * spp
            samples += spp
            rate = samples / seconds
        # Where a render takes longer than the time between two marks, the image is that of the mark before.
        if samples > told:
            told = samples
            (total / samples).astype("float32").tofile(job["file"])
            answer(seconds=seconds, samples=samples)
            # The file is read before the next one is written.
            sys.stdin.readline()
    answer(done=True, rate=rate, memory=1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)


def main():
    setup = json.loads(sys.stdin.readline())
    import numpy as np
    try:
        import mitsuba as mi
    except ImportError as error:
        return answer(error=f"the Python on the PATH has no package `mitsuba` ({error}); `pip install mitsuba` gets it")
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
        run(job, render, shape[0] * shape[1])


# Whatever libraries print must not get between the answers, progress bars of the native code included.
channel = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)
try:
    main()
except Exception as error:
    answer(error=str(error).strip() or type(error).__name__)
