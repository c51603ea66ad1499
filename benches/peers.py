#!/usr/bin/env python3
"""Gathering throughput and variance per sample against Mitsuba 3 on the same scene files.

  pip install mitsuba            (the llvm variant also needs libLLVM)
  cargo build --release
  python3 benches/peers.py SCENE.xml [SCENE.xml ...] [--runs 5] [--seconds 4] [--threads 2] [--json OUT]

Both render the same paths with the same max_depth and roulette (path integrator against
`--estimator gather`), runs interleaved, medians reported. Variance per sample is measured the same
way for both: the variance between images of different seeds times their samples, relative to the
squared mean, averaged over pixels without the worst 0.1 %.
"""
import argparse, json, os, statistics, subprocess, sys, tempfile, time
import numpy as np

try:
    import mitsuba as mi
except ImportError:
    sys.exit("the mitsuba package is missing: pip install mitsuba")

BINARY = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "target", "release", "nephroid")


class Mitsuba:
    """One variant with the scene loaded and, for the llvm variant, compiled."""

    def __init__(self, variant, path, threads):
        mi.set_variant(variant)
        import drjit as dr
        dr.set_thread_count(threads)
        self.variant, self.name, self.spp = variant, variant, 4
        self.scene = mi.load_file(path, integrator="path")
        self.render(1, 0)

    def render(self, spp, seed):
        mi.set_variant(self.variant)
        start = time.perf_counter()
        image = np.array(mi.render(self.scene, spp=spp, seed=seed))[..., :3]
        return image, time.perf_counter() - start


class Nephroid:
    """The command line; its own figure for the time spent rendering."""

    def __init__(self, path, threads):
        self.path, self.threads, self.name, self.spp = path, threads, "nephroid", 4

    def render(self, spp, seed):
        with tempfile.TemporaryDirectory() as d:
            out, stats = os.path.join(d, "o.exr"), os.path.join(d, "s.json")
            command = [BINARY, "render", self.path, "-o", out, "--estimator", "gather", "--spp", str(spp), "--seed",
                       str(seed), "--threads", str(self.threads), "--quiet", "--stats", stats]
            subprocess.run(command, check=True)
            image = np.array(dict(mi.Bitmap(out).split())["<root>"].convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
            return image, json.load(open(stats))["render_seconds"]


def variance_per_sample(images, spp):
    """Relative variance of one sample, averaged over pixels without the worst 0.1 %."""
    stack = np.stack(images).astype(np.float64)
    mean = stack.mean(0)
    relative = stack.var(0, ddof=1) * spp / (mean**2 + 0.01 * mean.mean() ** 2)
    per_pixel = np.sort(relative.mean(-1).ravel())
    return per_pixel[: int(len(per_pixel) * 0.999)].mean()


def compare(path, args):
    renderers = [Nephroid(path, args.threads)]
    for variant in ("scalar_rgb", "llvm_ad_rgb"):
        try:
            renderers.append(Mitsuba(variant, path, args.threads))
        except Exception as error:  # a variant that cannot be loaded is left out
            print(f"  {variant} left out: {error}", file=sys.stderr)
    for r in renderers:  # choose samples so that a run takes the wanted time
        _, t = r.render(r.spp, 1)
        r.spp = max(1, int(r.spp * args.seconds / max(t, 1e-3)))
        r.rates = []
    for run in range(args.runs):
        for r in renderers:
            _, t = r.render(r.spp, 10 + run)
            r.rates.append(r.spp / t)
    spp, seeds = args.variance_spp, args.variance_seeds
    for r in renderers:
        r.variance = variance_per_sample([r.render(spp, 100 + s)[0] for s in range(seeds)], spp) if seeds > 1 else float("nan")
    ours, peers = renderers[0], renderers[1:]
    best = max(peers, key=lambda r: statistics.median(r.rates))
    row = {
        "scene": os.path.basename(os.path.dirname(os.path.abspath(path))),
        "samples_per_second": {r.name: statistics.median(r.rates) for r in renderers},
        "ratio": statistics.median(ours.rates) / statistics.median(best.rates),
        "faster_peer": best.name,
        "variance_per_sample": {r.name: r.variance for r in renderers},
        "variance_ratio": ours.variance / min(r.variance for r in peers),
    }
    rates = "  ".join(f"{n} {v:.2f}" for n, v in row["samples_per_second"].items())
    print(f"{row['scene']:16s} spp/s: {rates}   ratio {row['ratio']:.2f}   variance ratio {row['variance_ratio']:.3f}", flush=True)
    return row


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("scenes", nargs="+")
    p.add_argument("--runs", type=int, default=5)
    p.add_argument("--seconds", type=float, default=4.0)
    p.add_argument("--threads", type=int, default=2)
    p.add_argument("--variance-spp", type=int, default=8)
    p.add_argument("--variance-seeds", type=int, default=8)
    p.add_argument("--json")
    args = p.parse_args()
    rows = [compare(s, args) for s in args.scenes]
    ratios = [r["ratio"] for r in rows]
    print(f"geometric mean of the ratios {np.exp(np.mean(np.log(ratios))):.2f}, least {min(ratios):.2f}")
    if args.json:
        json.dump(rows, open(args.json, "w"), indent=2)


if __name__ == "__main__":
    main()
