//! Embree as the yardstick, loaded at run time from the `embreex` wheel (pip install embreex).

use glam::Vec3;
use libloading::Library;
use nephroid::scene::geometry::Ray;
use std::ffi::{c_char, c_uint, c_void};
use std::path::{Path, PathBuf};
use std::process::Command;

const UINT3: c_uint = 0x5003;
const FLOAT3: c_uint = 0x9003;
const ROBUST: c_uint = 1 << 2;
const INVALID: u32 = u32::MAX;

#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct RayHit {
    o: [f32; 3],
    t_near: f32,
    d: [f32; 3],
    time: f32,
    t_far: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal: [f32; 3],
    u: f32,
    v: f32,
    prim: u32,
    geometry: u32,
    instance: u32,
    /// Room for what later versions add.
    more: [u32; 8],
}

type Intersect = unsafe extern "C" fn(*mut c_void, *mut RayHit, *const c_void);

/// A committed scene of one mesh.
pub struct Embree {
    scene: *mut c_void,
    intersect: Intersect,
    occluded: Intersect,
    _vertices: Vec<[f32; 3]>,
    _library: Library,
}

/// NEPHROID_EMBREE, or libembree4 beside the `embreex` package.
pub fn find() -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("NEPHROID_EMBREE") {
        return Some(path.into());
    }
    let script = "import importlib.util as u; print(u.find_spec('embreex').origin)";
    let out = Command::new("python3").args(["-c", script]).output().ok()?;
    let origin = String::from_utf8(out.stdout).ok()?;
    let packages = Path::new(origin.trim()).parent()?.parent()?.join("embreex.libs");
    let entries = std::fs::read_dir(packages).ok()?.flatten();
    entries.map(|e| e.path()).find(|p| p.file_name().is_some_and(|n| n.to_string_lossy().starts_with("libembree4")))
}

impl Embree {
    /// Builds over the mesh with Embree's robust mode; `quality` 1 = medium (default), 2 = high.
    pub fn new(path: &Path, positions: &[Vec3], triangles: &[[u32; 3]], robust: bool, quality: c_uint) -> Option<Self> {
        // The wheel's Embree needs its own TBB, which lies beside it.
        let beside = std::fs::read_dir(path.parent()?).ok()?.flatten().map(|e| e.path());
        for tbb in beside.filter(|p| p.file_name().is_some_and(|n| n.to_string_lossy().starts_with("libtbb"))) {
            // SAFETY: a library of the wheel, whose initialisers are those of any program using it.
            std::mem::forget(unsafe { Library::new(tbb) });
        }
        let mut vertices: Vec<[f32; 3]> = positions.iter().map(|p| p.to_array()).collect();
        // Embree reads 16 bytes at the last vertex.
        vertices.push([0.0; 3]);
        // SAFETY: signatures as in Embree 4's headers; the buffers outlive the scene (triangles are
        // copied into a leaked buffer, vertices are kept in `self`).
        unsafe {
            let library = Library::new(path).ok()?;
            type New = unsafe extern "C" fn(*const c_char) -> *mut c_void;
            type From = unsafe extern "C" fn(*mut c_void) -> *mut c_void;
            type FromKind = unsafe extern "C" fn(*mut c_void, c_uint) -> *mut c_void;
            type Set = unsafe extern "C" fn(*mut c_void, c_uint);
            type Do = unsafe extern "C" fn(*mut c_void);
            type Attach = unsafe extern "C" fn(*mut c_void, *mut c_void) -> c_uint;
            type Buffer = unsafe extern "C" fn(*mut c_void, c_uint, c_uint, c_uint, *const c_void, usize, usize, usize);
            let device = library.get::<New>(b"rtcNewDevice\0").ok()?(c"threads=1".as_ptr());
            let scene = library.get::<From>(b"rtcNewScene\0").ok()?(device);
            library.get::<Set>(b"rtcSetSceneFlags\0").ok()?(scene, if robust { ROBUST } else { 0 });
            library.get::<Set>(b"rtcSetSceneBuildQuality\0").ok()?(scene, quality);
            let geometry = library.get::<FromKind>(b"rtcNewGeometry\0").ok()?(device, 0);
            let share = library.get::<Buffer>(b"rtcSetSharedGeometryBuffer\0").ok()?;
            let mut indices = triangles.to_vec();
            indices.extend([[0; 3]; 2]);
            let indices: &'static [[u32; 3]] = indices.leak();
            share(geometry, 0, 0, UINT3, indices.as_ptr().cast(), 0, 12, triangles.len());
            share(geometry, 1, 0, FLOAT3, vertices.as_ptr().cast(), 0, 12, positions.len());
            library.get::<Do>(b"rtcCommitGeometry\0").ok()?(geometry);
            library.get::<Attach>(b"rtcAttachGeometry\0").ok()?(scene, geometry);
            library.get::<Do>(b"rtcCommitScene\0").ok()?(scene);
            let intersect = *library.get::<Intersect>(b"rtcIntersect1\0").ok()?;
            let occluded = *library.get::<Intersect>(b"rtcOccluded1\0").ok()?;
            Some(Self { scene, intersect, occluded, _vertices: vertices, _library: library })
        }
    }

    /// t of the nearest hit.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<f32> {
        let mut it = query(ray);
        // SAFETY: a committed scene and a ray of Embree's layout.
        unsafe { (self.intersect)(self.scene, &mut it, std::ptr::null()) };
        (it.geometry != INVALID).then_some(it.t_far)
    }

    /// Any hit?
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        let mut it = query(ray);
        // SAFETY: as above.
        unsafe { (self.occluded)(self.scene, &mut it, std::ptr::null()) };
        it.t_far < 0.0
    }
}

#[inline]
fn query(ray: &Ray) -> RayHit {
    RayHit {
        o: ray.o.to_array(),
        t_near: 0.0,
        d: ray.d.to_array(),
        time: 0.0,
        t_far: ray.t_max,
        mask: u32::MAX,
        id: 0,
        flags: 0,
        normal: [0.0; 3],
        u: 0.0,
        v: 0.0,
        prim: INVALID,
        geometry: INVALID,
        instance: INVALID,
        more: [INVALID; 8],
    }
}
