//! What is recognised and not read, with words on what to do instead.

use super::reader::Certainty::{Hint, Magic, No};
use super::reader::{Certainty, Clues, Refusal};

/// Where the first file of a tar archive starts.
const IN_TAR: usize = 512;
/// Where a DICOM file has its magic.
const DICOM: usize = 128;

/// Files that tell a folder of Zarr.
#[cfg(not(feature = "zarr"))]
const ZARR: [&str; 3] = ["zarr.json", ".zarray", ".zgroup"];

/// Of two that are as sure the first one is told.
pub(super) const REFUSALS: &[Refusal] = &[
    Refusal {
        probe: |c| {
            // Without the usual preamble a DICOM file begins with an element of group 8.
            let bare = c.has(0, &[8, 0, 0, 0]) || c.has(0, &[8, 0, 5, 0]);
            if c.has(DICOM, b"DICM") { Magic } else { only(Hint, bare) }
        },
        says: "a DICOM file: not supported, convert the series to NRRD or NIfTI",
    },
    Refusal {
        probe: |c| only(Magic, is_tar(c) && c.has(IN_TAR + DICOM, b"DICM")),
        says: "a tar archive of DICOM files: not supported, convert the series to NRRD or NIfTI",
    },
    Refusal {
        probe: |c| only(Magic, is_tar(c)),
        says: "a tar archive: not supported, unpack it and name the volume file (a DICOM series is not supported either)",
    },
    Refusal {
        probe: |c| only(Magic, c.has(4, b"n+2\0") || c.has(4, b"ni2\0")),
        says: "a NIfTI-2 file: not supported, convert it to NIfTI-1",
    },
    Refusal {
        probe: |c| only(Magic, c.has(0, b"<?xml") || c.has(0, b"<VTKFile")),
        says: "an XML file: not supported (of VTK, the legacy .vtk format is read)",
    },
    Refusal { probe: |c| only(Magic, c.has(0, b"II*\0") || c.has(0, b"MM\0*")), says: "a TIFF file: not supported" },
    Refusal { probe: |c| only(Magic, c.has(0, b"\x89HDF")), says: "an HDF5 file: not supported" },
    Refusal {
        probe: |c| only(Magic, c.has_entry("DICOMDIR")),
        says: "is a directory of DICOM files: not supported, convert the series to NRRD or NIfTI and give that file",
    },
    #[cfg(not(feature = "zarr"))]
    Refusal {
        probe: |c| only(Magic, ZARR.iter().any(|name| c.has_entry(name))),
        says: "is a directory of Zarr arrays: this build has no feature zarr, which reads them; else save one array as .npy or NRRD",
    },
    #[cfg(not(feature = "zarr"))]
    Refusal {
        probe: |c| only(Magic, c.has(0, b"{") && ZARR.iter().any(|name| c.path.file_name() == Some(name.as_ref()))),
        says: "metadata of Zarr: this build has no feature zarr, which reads it",
    },
];

fn only(certainty: Certainty, holds: bool) -> Certainty {
    if holds { certainty } else { No }
}

fn is_tar(clues: &Clues) -> bool {
    clues.has(257, b"ustar")
}
