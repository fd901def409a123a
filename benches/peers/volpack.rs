//! Shear-warp by VolPack, loaded at run time: one thread, 8 bits a colour.
//!
//! Constants have the values of its volpack.h.

#![allow(unsafe_code, reason = "calls into a C library; each call states why it is sound")]
#![allow(non_snake_case, reason = "the functions keep VolPack's names")]

use super::case::{Case, SIDE, TILT, TURN};
use libloading::Library;
use std::error::Error;
use std::ffi::{CStr, c_char, c_double, c_int, c_uint, c_void};
use std::time::Instant;

const LIBRARIES: [&str; 2] = ["libvolpack.so.1", "libvolpack.so"];

const VP_MODEL: c_int = 0;
const VP_PROJECT: c_int = 2;
const VP_X_AXIS: c_int = 0;
const VP_Y_AXIS: c_int = 1;
const VP_MIN_VOXEL_OPACITY: c_int = 1014;
const VP_MAX_RAY_OPACITY: c_int = 1043;
const VP_PARALLEL: c_int = 2400;
const VP_RGB: c_int = 5003;

/// Opacities that it takes for nothing and for everything: what its manual's programs take.
const LEAST_OPACITY: f64 = 0.002;
const MOST_OPACITY: f64 = 0.998;

type Context = *mut c_void;

macro_rules! functions {
    ($(fn $name:ident($($type:ty),*) $(-> $result:ty)?;)*) => {
        struct Functions { $($name: unsafe extern "C" fn($($type),*) $(-> $result)?,)* }

        impl Functions {
            fn load(library: &Library) -> Result<Self, libloading::Error> {
                // SAFETY: each name is that of a C function whose parameters and result are those of volpack.h, as declared here.
                unsafe { Ok(Self { $($name: *library.get(concat!(stringify!($name), "\0").as_bytes())?,)* }) }
            }
        }
    };
}

functions! {
    fn vpCreateContext() -> Context;
    fn vpDestroyContext(Context);
    fn vpSetVolumeSize(Context, c_int, c_int, c_int) -> c_uint;
    fn vpSetVoxelSize(Context, c_int, c_int, c_int, c_int) -> c_uint;
    fn vpSetVoxelField(Context, c_int, c_int, c_int, c_int) -> c_uint;
    fn vpSetRawVoxels(Context, *mut c_void, c_int, c_int, c_int, c_int) -> c_uint;
    fn vpSetClassifierTable(Context, c_int, c_int, *mut f32, c_int) -> c_uint;
    fn vpSetLookupShader(Context, c_int, c_int, c_int, *mut f32, c_int, c_int, *mut f32, c_int) -> c_uint;
    fn vpSetd(Context, c_int, c_double) -> c_uint;
    fn vpClassifyVolume(Context) -> c_uint;
    fn vpSetImage(Context, *mut u8, c_int, c_int, c_int, c_int) -> c_uint;
    fn vpCurrentMatrix(Context, c_int) -> c_uint;
    fn vpIdentityMatrix(Context) -> c_uint;
    fn vpWindow(Context, c_int, c_double, c_double, c_double, c_double, c_double, c_double) -> c_uint;
    fn vpRotate(Context, c_int, c_double) -> c_uint;
    fn vpScale(Context, c_double, c_double, c_double) -> c_uint;
    fn vpRenderClassifiedVolume(Context) -> c_uint;
    fn vpGetErrorString(c_uint) -> *const c_char;
}

/// A voxel: what the shader looks up and what the classifier does. VolPack wants two bytes for the first.
#[derive(Clone, Copy)]
#[repr(C)]
struct Voxel {
    color: u16,
    value: u8,
    padding: u8,
}

/// A classified volume, ready for frames.
pub(crate) struct VolPack {
    functions: Functions,
    context: Context,
    /// What the library reads and writes by pointer, for as long as the context lives.
    voxels: Vec<Voxel>,
    opacities: Vec<f32>,
    colors: Vec<f32>,
    image: Vec<u8>,
    // The functions are the library's: it stays as long as they do.
    _library: Library,
}

impl Drop for VolPack {
    fn drop(&mut self) {
        // SAFETY: the context is this one's own, and not used any more.
        unsafe { (self.functions.vpDestroyContext)(self.context) }
    }
}

/// The library and its functions; `None` where it is not installed.
fn load() -> Option<(Library, Functions)> {
    LIBRARIES.iter().find_map(|name| {
        // SAFETY: a library of plain C without start-up code.
        let library = unsafe { Library::new(name) }.ok()?;
        let functions = Functions::load(&library).ok()?;
        Some((library, functions))
    })
}

impl VolPack {
    /// `case`, classified; `None` where the library is not installed.
    pub(crate) fn new(case: &Case) -> Result<Option<Self>, Box<dyn Error>> {
        let Some((library, functions)) = load() else { return Ok(None) };
        // Its table holds opacities of one voxel.
        let slabs = case.volume.grid().smallest_spacing() / case.unit();
        let table = case.table();
        // SAFETY: takes nothing.
        let context = unsafe { (functions.vpCreateContext)() };
        let mut this = Self {
            functions,
            context,
            voxels: case.bytes().iter().map(|&v| Voxel { color: v.into(), value: v, padding: 0 }).collect(),
            opacities: table.iter().map(|e| -f64::exp_m1(slabs * f64::ln_1p(-e[3])) as f32).collect(),
            colors: table.iter().flat_map(|e| [e[0], e[1], e[2]].map(|c| (255.0 * c) as f32)).collect(),
            image: vec![0; 3 * (SIDE * SIDE) as usize],
            _library: library,
        };
        this.prepare(case)?;
        Ok(Some(this))
    }

    fn check(&self, code: c_uint) -> Result<(), Box<dyn Error>> {
        if code == 0 {
            return Ok(());
        }
        // SAFETY: gives a text that ends with 0 and that the library keeps.
        let text = unsafe { CStr::from_ptr((self.functions.vpGetErrorString)(code)) };
        Err(format!("VolPack: {}", text.to_string_lossy()).into())
    }

    fn prepare(&mut self, case: &Case) -> Result<(), Box<dyn Error>> {
        let [nx, ny, nz] = case.volume.grid().dims().map(|n| n as c_int);
        let size = size_of::<Voxel>() as c_int;
        let (context, bytes) = (self.context, |floats: &[f32]| size_of_val(floats) as c_int);
        let (opacity_bytes, color_bytes) = (bytes(&self.opacities), bytes(&self.colors));
        let side = SIDE as c_int;
        let f = &self.functions;
        // SAFETY: the sizes in bytes are those of the vectors, which live and stay in their place as long as the context: nothing in
        // this type makes them longer. Fields lie in the voxel where its C layout puts them.
        let codes = unsafe {
            [
                (f.vpSetVolumeSize)(context, nx, ny, nz),
                (f.vpSetVoxelSize)(context, size, 2, 1, 1),
                (f.vpSetVoxelField)(context, 0, 2, 0, 255),
                (f.vpSetVoxelField)(context, 1, 1, 2, 255),
                (f.vpSetRawVoxels)(context, self.voxels.as_mut_ptr().cast(), size * nx * ny * nz, size, size * nx, size * nx * ny),
                (f.vpSetClassifierTable)(context, 0, 1, self.opacities.as_mut_ptr(), opacity_bytes),
                (f.vpSetLookupShader)(context, 3, 1, 0, self.colors.as_mut_ptr(), color_bytes, 0, std::ptr::null_mut(), 0),
                (f.vpSetd)(context, VP_MIN_VOXEL_OPACITY, LEAST_OPACITY),
                (f.vpSetd)(context, VP_MAX_RAY_OPACITY, MOST_OPACITY),
                (f.vpClassifyVolume)(context),
                (f.vpSetImage)(context, self.image.as_mut_ptr(), side, side, 3 * side, VP_RGB),
            ]
        };
        codes.into_iter().try_for_each(|code| self.check(code))?;
        let (n, h) = (case.volume.grid().dims(), case.volume.grid().spacing());
        let extent = [0, 1, 2].map(|i| n[i] as f64 * h[i]);
        let longest = extent.iter().fold(0.0, |a: f64, &b| a.max(b));
        let [x, y, z] = extent.map(|e| e / longest);
        let f = &self.functions;
        // SAFETY: takes numbers alone.
        let codes = unsafe {
            [
                (f.vpCurrentMatrix)(context, VP_PROJECT),
                (f.vpIdentityMatrix)(context),
                (f.vpWindow)(context, VP_PARALLEL, -0.9, 0.9, -0.9, 0.9, -2.0, 2.0),
                (f.vpCurrentMatrix)(context, VP_MODEL),
                (f.vpIdentityMatrix)(context),
                // Its angles turn the other way.
                (f.vpRotate)(context, VP_X_AXIS, -TILT),
                (f.vpRotate)(context, VP_Y_AXIS, -TURN),
                (f.vpScale)(context, x, y, z),
            ]
        };
        codes.into_iter().try_for_each(|code| self.check(code))
    }

    /// Seconds for a frame.
    pub(crate) fn frame(&mut self) -> Result<f64, Box<dyn Error>> {
        let start = Instant::now();
        // SAFETY: everything that the library reads and writes is in place.
        let code = unsafe { (self.functions.vpRenderClassifiedVolume)(self.context) };
        let seconds = start.elapsed().as_secs_f64();
        self.check(code)?;
        Ok(seconds)
    }

    /// The last frame, row 0 on top.
    pub(crate) fn picture(&self) -> Vec<[f32; 4]> {
        // Read through a pointer as the library writes, behind the compiler's back.
        // SAFETY: every index is within the vector.
        let byte = |i: usize| f32::from(unsafe { self.image.as_ptr().add(i).read_volatile() }) / 255.0;
        let rows = (0..SIDE as usize).rev();
        rows.flat_map(|y| (0..SIDE as usize).map(move |x| 3 * (y * SIDE as usize + x)))
            .map(|i| [byte(i), byte(i + 1), byte(i + 2), 1.0])
            .collect()
    }
}
