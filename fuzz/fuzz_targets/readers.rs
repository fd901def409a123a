//! Any bytes as a volume file of any name: read, or refused in one line, within the limits.
#![no_main]

use libfuzzer_sys::fuzz_target;
use slicestack::Limits;
use slicestack::volume::io::{self, Reading};
use std::path::PathBuf;
use std::sync::OnceLock;

/// Names that formats go by; the first byte chooses.
const NAMES: [&str; 24] = [
    "nrrd", "nhdr", "nii", "nii.gz", "hdr", "img", "mha", "mhd", "vtk", "vti", "vtr", "mrc", "npy", "npz", "dcm", "tif", "ome.tif", "png",
    "jpg", "bmp", "zip", "tar", "dat", "zarr.zip",
];

/// A folder in memory, of this process alone.
fn folder() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let base = ["/dev/shm", "/tmp"].into_iter().find(|f| std::path::Path::new(f).is_dir()).unwrap_or(".");
        let folder = PathBuf::from(base).join(format!("slicestack-fuzz-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for inputs");
        folder
    })
}

fuzz_target!(|data: &[u8]| {
    let Some((&name, bytes)) = data.split_first() else { return };
    let path = folder().join(format!("input.{}", NAMES[usize::from(name) % NAMES.len()]));
    std::fs::write(&path, bytes).expect("an input is written");
    let mut limits = Limits::new().voxel_bytes(1 << 22).header_bytes(1 << 16);
    if name >= 128 {
        limits = limits.map_bytes(0);
    }
    let mut reading = Reading::new();
    reading.limits = limits;
    drop(io::list(&path, &reading));
    match io::read(&path, &limits) {
        Ok(volume) => assert!(volume.voxels().len() as u64 * volume.voxels().voxel_type().bytes() as u64 <= 1 << 22),
        Err(error) => {
            let text = error.to_string();
            assert!(!text.is_empty() && !text.contains('\n'), "{text:?}");
        }
    }
});
