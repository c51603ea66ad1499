"""Writes reference.txt: BSDF values and densities of Mitsuba 3 (pip install mitsuba==3.9.1).

A line holds the name of the model, w_back, w_next, f per lane (eval over the cosine), the density of
w_next, all in radiance mode at uv = (0.3, 0.4), wherever the density is above zero.
"""

import sys
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

TEXELS = np.array([0.1, 0.2, 0.3, 0.9, 0.5, 0.4, 0.3, 0.8, 0.2, 0.6, 0.6, 0.1], np.float32).reshape(2, 2, 3)


def rgb(*v):
    return {"type": "rgb", "value": list(v)}


def bitmap():
    return {"type": "bitmap", "bitmap": mi.Bitmap(TEXELS), "raw": True}


def checker(a, b):
    return {"type": "checkerboard", "color0": a, "color1": b}


def diffuse(reflectance):
    return {"type": "diffuse", "reflectance": reflectance}


def unbounded(r, g, b):
    return {"type": "bitmap", "bitmap": mi.Bitmap(np.tile(np.array([r, g, b], np.float32), (2, 2, 1))), "raw": True}


def rough_conductor(distribution, alpha, perfect):
    d = {"type": "roughconductor", "distribution": distribution, "alpha_u": alpha[0], "alpha_v": alpha[1]}
    if not perfect:
        d |= {"eta": unbounded(0.143, 0.375, 1.442), "k": unbounded(3.983, 2.386, 1.603)}
    return d


def rough_dielectric(distribution, alpha, int_ior, ext_ior):
    return {
        "type": "roughdielectric",
        "distribution": distribution,
        "alpha_u": alpha[0],
        "alpha_v": alpha[1],
        "int_ior": int_ior,
        "ext_ior": ext_ior,
    }


def plastic(nonlinear, diffuse, specular):
    return {
        "type": "plastic",
        "int_ior": 1.49,
        "ext_ior": 1.000277,
        "nonlinear": nonlinear,
        "diffuse_reflectance": diffuse,
        "specular_reflectance": specular,
    }


def rough_plastic(distribution, alpha, int_ior, nonlinear):
    return {
        "type": "roughplastic",
        "distribution": distribution,
        "alpha": alpha,
        "int_ior": int_ior,
        "ext_ior": 1.000277,
        "nonlinear": nonlinear,
        "diffuse_reflectance": rgb(0.1, 0.27, 0.66),
    }


def principled(**parameters):
    return {"type": "principled"} | parameters


def blend(weight, first, second):
    return {"type": "blendbsdf", "weight": weight, "a": first, "b": second}


MODELS = {
    "diffuse": diffuse(rgb(0.2, 0.5, 0.7)),
    "diffuse_white": diffuse(1.0),
    "diffuse_bitmap": diffuse(bitmap()),
    "diffuse_checkerboard": diffuse(checker(0.4, 0.2)),
    "roughconductor_ggx_02": rough_conductor("ggx", [0.2, 0.2], False),
    "roughconductor_beckmann_01": rough_conductor("beckmann", [0.1, 0.1], False),
    "roughconductor_ggx_1": rough_conductor("ggx", [1.0, 1.0], True),
    "roughconductor_beckmann_1": rough_conductor("beckmann", [1.0, 1.0], True),
    "roughconductor_ggx_brushed": rough_conductor("ggx", [0.05, 0.4], False),
    "roughconductor_beckmann_brushed": rough_conductor("beckmann", [0.5, 0.2], False),
    "roughdielectric_ggx_03": rough_dielectric("ggx", [0.3, 0.3], 1.5, 1.0),
    "roughdielectric_ggx_1": rough_dielectric("ggx", [1.0, 1.0], 2.4, 1.0),
    "roughdielectric_beckmann_01": rough_dielectric("beckmann", [0.1, 0.1], 1.5, 1.0),
    "roughdielectric_beckmann_bubble": rough_dielectric("beckmann", [0.4, 0.4], 1.0, 1.0 / 0.75),
    "roughdielectric_ggx_brushed": rough_dielectric("ggx", [0.6, 0.2], 1.33, 1.0),
    "plastic": plastic(False, rgb(0.1, 0.27, 0.66), 1.0),
    "plastic_nonlinear": plastic(True, rgb(0.1, 0.27, 0.96), 0.5),
    "plastic_bitmap": plastic(True, bitmap(), checker(0.4, 0.8)),
    "roughplastic_beckmann_01": rough_plastic("beckmann", 0.1, 1.49, False),
    "roughplastic_ggx_03": rough_plastic("ggx", 0.3, 1.9, True),
    "roughplastic_beckmann_1": rough_plastic("beckmann", 1.0, 1.49, True),
    "twosided": {"type": "twosided", "a": diffuse(0.5)},
    "twosided_different": {"type": "twosided", "a": diffuse(0.5), "b": rough_conductor("ggx", [0.5, 0.2], False)},
    "mask": {"type": "mask", "opacity": 0.3, "a": diffuse(0.5)},
    "mask_checkerboard": {"type": "mask", "opacity": checker(0.25, 0.75), "a": rough_plastic("ggx", 0.3, 1.9, False)},
    "blendbsdf": blend(bitmap(), diffuse(rgb(0.9, 0.5, 0.2)), rough_conductor("ggx", [0.2, 0.2], False)),
    "blendbsdf_nested": {
        "type": "mask",
        "opacity": 0.9,
        "a": blend(
            0.2,
            blend(
                0.6,
                {"type": "twosided", "a": diffuse(rgb(0.9, 0.5, 0.2))},
                rough_dielectric("ggx", [0.3, 0.3], 1.5, 1.0),
            ),
            {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0},
        ),
    },
    "principled": {"type": "principled"},
    "principled_metal": principled(
        base_color=rgb(0.9, 0.6, 0.2), roughness=0.4, anisotropic=0.7, metallic=1.0
    ),
    "principled_glass": principled(base_color=rgb(0.9, 0.8, 0.3), roughness=0.6, spec_trans=1.0, eta=1.5),
    "principled_cloth": principled(
        base_color=bitmap(), roughness=0.9, spec_tint=0.8, sheen=1.0, sheen_tint=0.5, flatness=0.6, specular=0.3
    ),
    "principled_all": principled(
        base_color=rgb(0.5, 0.3, 0.2),
        roughness=checker(0.5, 0.7),
        anisotropic=0.3,
        metallic=0.3,
        spec_trans=0.4,
        spec_tint=0.5,
        sheen=0.5,
        sheen_tint=0.7,
        flatness=0.2,
        clearcoat=0.8,
        clearcoat_gloss=0.4,
        eta=1.4,
    ),
}


def main(out, pairs):
    random = np.random.default_rng(1)
    context = mi.BSDFContext()
    for name, description in MODELS.items():
        bsdf = mi.load_dict(description)
        written = 0
        for _ in range(100 * pairs):
            z = random.uniform(-1, 1) if random.uniform() < 0.7 else random.choice([-1, 1]) * 10 ** random.uniform(-2.5, 0)
            phi = random.uniform(0, 2 * np.pi)
            w = np.array([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], np.float32)
            si = mi.SurfaceInteraction3f()
            si.wi, si.uv = mi.Vector3f(w), [0.3, 0.4]
            sample, _ = bsdf.sample(context, si, random.uniform(), random.uniform(size=2))
            wo = np.array(sample.wo, np.float32)
            if random.uniform() < 0.2:
                wo = random.normal(size=3)
                wo = (wo / np.linalg.norm(wo)).astype(np.float32)
            if not np.isfinite(wo).all() or abs(wo[2]) < 1e-3 or abs(np.linalg.norm(wo) - 1) > 1e-4:
                continue
            if np.linalg.norm(wo + w) < 1e-3 or np.linalg.norm(wo * [-1, -1, 1] - w) < 1e-6:
                continue
            pdf = bsdf.pdf(context, si, mi.Vector3f(wo))
            f = np.array(bsdf.eval(context, si, mi.Vector3f(wo))) / abs(wo[2])
            if pdf > 1e-4:
                print(name, *(f"{x:.8g}" for x in [*w, *wo, *f, pdf]), file=out)
                written += 1
            if written == pairs:
                break


if __name__ == "__main__":
    with open(sys.argv[1], "w") as out:
        main(out, int(sys.argv[2]) if len(sys.argv) > 2 else 12)
