//! Any bytes as a volume file of any name: read within the limits, or refused in one line.

use super::check_line;
use slicestack::Limits;
use slicestack::volume::io::{self, Reading};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Names that formats go by; the first byte chooses.
pub const NAMES: [&str; 24] = [
    "nrrd", "nhdr", "nii", "nii.gz", "hdr", "img", "mha", "mhd", "vtk", "vti", "vtr", "mrc", "npy", "npz", "dcm", "tif", "ome.tif", "png",
    "jpg", "bmp", "zip", "tar", "dat", "zarr.zip",
];

/// Most bytes of voxels.
const MOST: u64 = 1 << 22;

/// A folder in memory, of this process alone.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let shm = Path::new("/dev/shm");
        let base = if shm.is_dir() { shm.to_path_buf() } else { std::env::temp_dir() };
        let folder = base.join(format!("slicestack-fuzz-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for inputs");
        folder
    })
}

pub fn run(data: &[u8]) {
    let Some((&name, bytes)) = data.split_first() else { return };
    let path = folder().join(format!("input.{}", NAMES[usize::from(name) % NAMES.len()]));
    std::fs::write(&path, bytes).expect("an input is written");
    let limits = Limits::new().voxel_bytes(MOST).header_bytes(1 << 16).map_bytes(if name < 128 { u64::MAX } else { 0 });
    if let Err(error) = io::list(&path, &Reading::new().limits(limits)) {
        check_line(&error);
    }
    match io::read(&path, &limits) {
        Ok(volume) => assert!((volume.voxels().len() * volume.voxels().voxel_type().bytes()) as u64 <= MOST),
        Err(error) => check_line(&error),
    }
    drop(std::fs::remove_file(&path));
}
