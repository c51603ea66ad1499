"""What the scripts of all peers share, as children of `nephroid bench`; its text goes before theirs.

The job is one line of JSON on standard input, then one line per run. Every answer is one line of JSON.
Images are written as raw 32 bit floats, three per pixel, to the file that the run names.
"""
import json, os, resource, sys, time


def answer(**what):
    print(json.dumps(what), file=channel, flush=True)


def without(package, error):
    answer(error=f"this Python has no package `{package}` ({error}); `pip install {package}` gets it, and the environment "
                 "variable NEPHROID_PYTHON names another Python")


def tell_image(job, image, **what):
    """At a mark, `image` with the first row on top."""
    image.astype("float32").tofile(job["file"])
    answer(**what)
    # The file is read before the next one is written.
    sys.stdin.readline()


def tell_end(**what):
    answer(done=True, memory=1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, **what)


def run_pieces(job, piece, most, cautious=False):
    """To every mark, in pieces that end there; their mean is weighted by samples. `piece` makes so many samples after so many,
    at most `most`, and answers with their mean and the seconds they took."""
    total, samples, seconds, told = None, 0, 0.0, 0
    rate = job.get("rate") or 1.0
    for mark in job["marks"]:
        while True:
            left = mark["samples"] - samples if "samples" in mark else (mark["seconds"] - seconds) * rate
            if left <= 0 or ("seconds" in mark and samples and left < 0.5):
                break
            # Where the rate may change much, not all at once.
            spp = max(1, min(round(0.7 * left if cautious and left >= 8 and "seconds" in mark else left), most))
            image, took = piece(spp, samples)
            seconds += took
            total = image.astype("float64") * spp if total is None else total + image.astype("float64") * spp
            samples += spp
            rate = samples / seconds
        # Where a render takes longer than the time between two marks, the image is that of the mark before.
        if samples > told:
            told = samples
            tell_image(job, total / samples, seconds=seconds, samples=samples)
    tell_end(rate=rate)


def serve(main):
    """Whatever libraries print must not get between the answers, progress bars of the native code included."""
    global channel
    channel = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    try:
        main()
    except Exception as error:
        answer(error=str(error).strip() or type(error).__name__)
