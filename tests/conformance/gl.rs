//! The few functions of OpenGL that the test calls, from Mesa's off-screen library, loaded at run time.
//!
//! Constants have the values of the OpenGL registry.

#![allow(unsafe_code, reason = "calls into a C library; each call states why it is sound")]
#![allow(non_snake_case, reason = "the functions keep OpenGL's names")]

use libloading::Library;
use std::ffi::{CStr, c_char, c_int, c_void};

/// Where the library is, by Debian's names.
const LIBRARIES: [&str; 2] = ["libOSMesa.so.8", "libOSMesa.so"];

/// Everything that a numbered constant of OpenGL is needed for.
pub(crate) mod constant {
    macro_rules! constants { ($($name:ident = $value:literal;)*) => { $(pub(crate) const $name: u32 = $value;)* }; }
    constants! {
        COLOR_BUFFER_BIT = 0x4000;
        TRIANGLE_FAN = 0x6; POLYGON = 0x9;
        UNSIGNED_BYTE = 0x1401; UNSIGNED_SHORT = 0x1403; FLOAT = 0x1406;
        RED = 0x1903; RGBA = 0x1908; R8 = 0x8229; RGBA8 = 0x8058; R32F = 0x822E; RGBA32F = 0x8814;
        TEXTURE_1D = 0xDE0; TEXTURE_3D = 0x806F; TEXTURE0 = 0x84C0;
        TEXTURE_MAG_FILTER = 0x2800; TEXTURE_MIN_FILTER = 0x2801; NEAREST = 0x2600; LINEAR = 0x2601;
        TEXTURE_WRAP_S = 0x2802; TEXTURE_WRAP_T = 0x2803; TEXTURE_WRAP_R = 0x8072; TEXTURE_BORDER_COLOR = 0x1004;
        REPEAT = 0x2901; CLAMP_TO_BORDER = 0x812D; CLAMP_TO_EDGE = 0x812F;
        TEXTURE_ENV = 0x2300; TEXTURE_ENV_MODE = 0x2200; REPLACE = 0x1E01; MODULATE = 0x2100;
        UNPACK_ALIGNMENT = 0xCF5; RENDERER = 0x1F01; VERSION = 0x1F02;
        MODELVIEW = 0x1700; PROJECTION = 0x1701; TEXTURE = 0x1702;
        FOG = 0xB60; FOG_DENSITY = 0xB62; FOG_START = 0xB63; FOG_END = 0xB64; FOG_MODE = 0xB65; FOG_COLOR = 0xB66;
        EXP = 0x800; EXP2 = 0x801; FOG_COORDINATE_SOURCE = 0x8450; FOG_COORDINATE = 0x8451;
        BLEND = 0xBE2; ALPHA_TEST = 0xBC0; SCISSOR_TEST = 0xC11; DITHER = 0xBD0; CLIP_PLANE0 = 0x3000;
        FRAGMENT_PROGRAM = 0x8804; PROGRAM_FORMAT_ASCII = 0x8875;
    }
}

/// Keys of a context's attributes.
const OSMESA_FORMAT: c_int = 0x22;
const OSMESA_DEPTH_BITS: c_int = 0x30;
const OSMESA_PROFILE: c_int = 0x33;
const OSMESA_COMPAT_PROFILE: c_int = 0x35;

macro_rules! functions {
    ($(fn $name:ident($($arg:ident: $type:ty),*) $(-> $result:ty)?;)* raw $(fn $raw:ident($($raw_type:ty),*) $(-> $raw_result:ty)?;)*) => {
        struct Functions {
            $($name: unsafe extern "C" fn($($type),*) $(-> $result)?,)*
            $($raw: unsafe extern "C" fn($($raw_type),*) $(-> $raw_result)?,)*
        }

        impl Functions {
            fn load(library: &Library) -> Result<Self, libloading::Error> {
                // SAFETY: each name is that of a C function whose parameters and result are those of the OpenGL registry and of
                // Mesa's osmesa.h, as declared here.
                unsafe {
                    Ok(Self {
                        $($name: *library.get(concat!(stringify!($name), "\0").as_bytes())?,)*
                        $($raw: *library.get(concat!(stringify!($raw), "\0").as_bytes())?,)*
                    })
                }
            }
        }

        impl Context<'_> {
            $(
                pub(crate) fn $name(&self, $($arg: $type),*) $(-> $result)? {
                    // SAFETY: takes numbers alone, and a context is current as long as `self` lives.
                    unsafe { (self.gl.functions.$name)($($arg),*) }
                }
            )*
        }
    };
}

functions! {
    fn glActiveTexture(unit: u32);
    fn glAlphaFunc(function: u32, reference: f32);
    fn glBegin(mode: u32);
    fn glBindProgramARB(target: u32, program: u32);
    fn glBindTexture(target: u32, texture: u32);
    fn glBlendColor(r: f32, g: f32, b: f32, a: f32);
    fn glBlendEquationSeparate(color: u32, alpha: u32);
    fn glBlendFuncSeparate(source: u32, destination: u32, source_alpha: u32, destination_alpha: u32);
    fn glClear(mask: u32);
    fn glClearColor(r: f32, g: f32, b: f32, a: f32);
    fn glColor4d(r: f64, g: f64, b: f64, a: f64);
    fn glDisable(what: u32);
    fn glEnable(what: u32);
    fn glEnd();
    fn glFinish();
    fn glFogCoordd(coordinate: f64);
    fn glFogf(key: u32, value: f32);
    fn glFogi(key: u32, value: c_int);
    fn glFrustum(left: f64, right: f64, bottom: f64, top: f64, near: f64, far: f64);
    fn glGetError() -> u32;
    fn glLoadIdentity();
    fn glMatrixMode(mode: u32);
    fn glMultiTexCoord3d(unit: u32, s: f64, t: f64, p: f64);
    fn glOrtho(left: f64, right: f64, bottom: f64, top: f64, near: f64, far: f64);
    fn glPixelStorei(key: u32, value: c_int);
    fn glScissor(x: c_int, y: c_int, width: c_int, height: c_int);
    fn glTexCoord3d(s: f64, t: f64, p: f64);
    fn glTexEnvi(target: u32, key: u32, value: c_int);
    fn glTexParameteri(target: u32, key: u32, value: c_int);
    fn glVertex3d(x: f64, y: f64, z: f64);
    fn glViewport(x: c_int, y: c_int, width: c_int, height: c_int);
    raw
    fn glClipPlane(u32, *const f64);
    fn glFogfv(u32, *const f32);
    fn glGenTextures(c_int, *mut u32);
    fn glGetString(u32) -> *const u8;
    fn glLoadMatrixd(*const f64);
    fn glProgramStringARB(u32, u32, c_int, *const c_void);
    fn glTexImage1D(u32, c_int, c_int, c_int, c_int, u32, u32, *const c_void);
    fn glTexImage3D(u32, c_int, c_int, c_int, c_int, c_int, c_int, u32, u32, *const c_void);
    fn glTexParameterfv(u32, u32, *const f32);
    fn OSMesaCreateContextAttribs(*const c_int, *mut c_void) -> *mut c_void;
    fn OSMesaDestroyContext(*mut c_void);
    fn OSMesaMakeCurrent(*mut c_void, *mut c_void, u32, c_int, c_int) -> u8;
}

/// The library.
pub(crate) struct Gl {
    functions: Functions,
    // The functions are the library's: it stays as long as they do.
    _library: Library,
}

impl Gl {
    /// Loads Mesa.
    ///
    /// # Errors
    /// What to install, without it: a comparison that does not take place must not pass.
    pub(crate) fn load() -> Result<Self, String> {
        let mut tried = Vec::new();
        for name in LIBRARIES {
            // SAFETY: Mesa's library; its start-up code has no other demands than that it be loaded once.
            match unsafe { Library::new(name) } {
                Ok(library) => match Functions::load(&library) {
                    Ok(functions) => return Ok(Self { functions, _library: library }),
                    Err(e) => tried.push(format!("{name}: {e}")),
                },
                Err(e) => tried.push(format!("{name}: {e}")),
            }
        }
        Err(format!("no OpenGL to compare with: install libOSMesa (Debian: apt-get install libosmesa6); {}", tried.join("; ")))
    }

    /// A compatibility context that draws into memory of its own: RGBA, `width` x `height`, components of type `kind`.
    pub(crate) fn context(&self, kind: u32, width: usize, height: usize) -> Context<'_> {
        let attributes = [OSMESA_FORMAT, constant::RGBA as c_int, OSMESA_DEPTH_BITS, 0, OSMESA_PROFILE, OSMESA_COMPAT_PROFILE, 0];
        // 16 bytes a pixel hold every type; f32 keeps them aligned.
        let mut pixels = vec![[0.0f32; 4]; width * height];
        // SAFETY: the list of attributes ends with 0; no context is shared.
        let handle = unsafe { (self.functions.OSMesaCreateContextAttribs)(attributes.as_ptr(), std::ptr::null_mut()) };
        assert!(!handle.is_null(), "OSMesa makes no compatibility context");
        // SAFETY: the buffer holds width x height pixels of 16 bytes, and lives as long as the context, which Context sees to.
        let made = unsafe { (self.functions.OSMesaMakeCurrent)(handle, pixels.as_mut_ptr().cast(), kind, width as c_int, height as c_int) };
        assert!(made != 0, "OSMesa does not draw into pixels of type {kind:#x}");
        Context { gl: self, handle, pixels, kind, width, height }
    }
}

/// A context that is current, and its framebuffer.
pub(crate) struct Context<'g> {
    gl: &'g Gl,
    handle: *mut c_void,
    pixels: Vec<[f32; 4]>,
    kind: u32,
    width: usize,
    height: usize,
}

impl Drop for Context<'_> {
    fn drop(&mut self) {
        // SAFETY: the handle is this context's own; nobody uses it afterwards.
        unsafe { (self.gl.functions.OSMesaDestroyContext)(self.handle) }
    }
}

/// The type of a slice's numbers, for OpenGL.
pub(crate) trait Component: Copy {
    const KIND: u32;
}

impl Component for u8 {
    const KIND: u32 = constant::UNSIGNED_BYTE;
}

impl Component for f32 {
    const KIND: u32 = constant::FLOAT;
}

/// Components of a format's texel.
fn components(format: u32) -> usize {
    if format == constant::RED { 1 } else { 4 }
}

impl Context<'_> {
    pub(crate) fn text(&self, key: u32) -> String {
        // SAFETY: for these keys glGetString gives a text that ends with 0 and that the library keeps, or null.
        unsafe {
            let text: *const c_char = (self.gl.functions.glGetString)(key).cast();
            if text.is_null() { String::new() } else { CStr::from_ptr(text).to_string_lossy().into_owned() }
        }
    }

    pub(crate) fn clip_plane(&self, i: usize, equation: [f64; 4]) {
        // SAFETY: reads four numbers.
        unsafe { (self.gl.functions.glClipPlane)(constant::CLIP_PLANE0 + i as u32, equation.as_ptr()) }
    }

    pub(crate) fn fog_color(&self, color: [f32; 4]) {
        // SAFETY: reads four numbers.
        unsafe { (self.gl.functions.glFogfv)(constant::FOG_COLOR, color.as_ptr()) }
    }

    pub(crate) fn border_color(&self, target: u32, color: [f32; 4]) {
        // SAFETY: reads four numbers.
        unsafe { (self.gl.functions.glTexParameterfv)(target, constant::TEXTURE_BORDER_COLOR, color.as_ptr()) }
    }

    /// Column after column.
    pub(crate) fn load_matrix(&self, matrix: [f64; 16]) {
        // SAFETY: reads sixteen numbers.
        unsafe { (self.gl.functions.glLoadMatrixd)(matrix.as_ptr()) }
    }

    /// Makes `program` the current ARB fragment program.
    pub(crate) fn fragment_program(&self, program: &str) {
        self.glBindProgramARB(constant::FRAGMENT_PROGRAM, 1);
        // SAFETY: reads as many bytes as it is told.
        unsafe {
            (self.gl.functions.glProgramStringARB)(
                constant::FRAGMENT_PROGRAM,
                constant::PROGRAM_FORMAT_ASCII,
                program.len() as c_int,
                program.as_ptr().cast(),
            );
        }
        assert_eq!(self.glGetError(), 0, "OpenGL does not take the program\n{program}");
        self.glEnable(constant::FRAGMENT_PROGRAM);
    }

    /// A new texture, bound to `target`; its name.
    pub(crate) fn new_texture(&self, target: u32) -> u32 {
        let mut name = 0;
        // SAFETY: writes one number.
        unsafe { (self.gl.functions.glGenTextures)(1, &raw mut name) }
        self.glBindTexture(target, name);
        name
    }

    /// The bound 1D texture's texels.
    pub(crate) fn image_1d<T: Component>(&self, internal: u32, format: u32, texels: &[T]) {
        let width = texels.len() / components(format);
        // SAFETY: reads `width` texels, which is how the width was found; rows have no padding (UNPACK_ALIGNMENT is 1).
        unsafe {
            (self.gl.functions.glTexImage1D)(
                constant::TEXTURE_1D,
                0,
                internal as c_int,
                width as c_int,
                0,
                format,
                T::KIND,
                texels.as_ptr().cast(),
            );
        }
    }

    /// The bound 3D texture's texels.
    pub(crate) fn image_3d<T: Component>(&self, internal: u32, dims: [usize; 3], format: u32, texels: &[T]) {
        assert_eq!(texels.len(), dims.iter().product::<usize>() * components(format));
        let [x, y, z] = dims.map(|n| n as c_int);
        // SAFETY: reads x * y * z texels, and so many there are; rows have no padding (UNPACK_ALIGNMENT is 1).
        unsafe {
            (self.gl.functions.glTexImage3D)(
                constant::TEXTURE_3D,
                0,
                internal as c_int,
                x,
                y,
                z,
                0,
                format,
                T::KIND,
                texels.as_ptr().cast(),
            );
        }
    }

    /// What was drawn, row 0 on top.
    pub(crate) fn finish(&self) -> Vec<[f32; 4]> {
        self.glFinish();
        assert_eq!(self.glGetError(), 0, "OpenGL reports an error");
        let count = self.width * self.height * 4;
        // Read through the pointer that OpenGL writes through, behind the compiler's back.
        // SAFETY: the buffer holds `count` components of each of these types, aligned for f32, and drawing is finished.
        let numbers: Vec<f32> = unsafe {
            let start = self.pixels.as_ptr();
            match self.kind {
                constant::UNSIGNED_BYTE => (0..count).map(|i| f32::from(start.cast::<u8>().add(i).read_volatile()) / 255.0).collect(),
                constant::UNSIGNED_SHORT => (0..count).map(|i| f32::from(start.cast::<u16>().add(i).read_volatile()) / 65535.0).collect(),
                _ => (0..count).map(|i| start.cast::<f32>().add(i).read_volatile()).collect(),
            }
        };
        let rows = numbers.chunks_exact(self.width * 4).rev();
        rows.flat_map(|row| row.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]])).collect()
    }
}
