//! What is recognised and not read, with words on what to do instead.

#[cfg(not(feature = "dicom"))]
use super::reader::Certainty::{Hint, Inner};
use super::reader::Certainty::{Length, Magic, No};
use super::reader::{Certainty, Clues, Refusal};

/// Where the first file of a tar archive starts.
#[cfg(not(feature = "dicom"))]
const IN_TAR: usize = 512;
/// Where a DICOM file has its magic.
#[cfg(not(feature = "dicom"))]
const DICOM: usize = 128;

/// Of two that are as sure the first one is told.
pub(super) const REFUSALS: &[Refusal] = &[
    #[cfg(not(feature = "dicom"))]
    Refusal {
        probe: |c| {
            // Without the usual preamble a DICOM file begins with an element of group 8.
            let bare = c.has(0, &[8, 0, 0, 0]) || c.has(0, &[8, 0, 5, 0]);
            if c.has(DICOM, b"DICM") { Inner } else { only(Hint, bare) }
        },
        says: "a DICOM file: this build was made without the feature `dicom`, convert the series to NRRD or NIfTI",
    },
    #[cfg(not(feature = "dicom"))]
    Refusal {
        probe: |c| only(Magic, is_tar(c) && c.has(IN_TAR + DICOM, b"DICM")),
        says: "a tar archive of DICOM files: this build was made without the feature `dicom`, convert the series to NRRD or NIfTI",
    },
    Refusal { probe: |c| only(Length, is_tar(c)), says: "a tar archive: not supported, unpack it and name the volume file" },
    Refusal {
        // A VTK file starts like this too; its reader comes first.
        probe: |c| only(Magic, c.has(0, b"<?xml")),
        says: "an XML file: not supported (of XML, VTK's image data is read)",
    },
    Refusal { probe: |c| only(Magic, c.has(0, b"II*\0") || c.has(0, b"MM\0*")), says: "a TIFF file: not supported" },
    Refusal { probe: |c| only(Magic, c.has(0, b"\x89HDF")), says: "an HDF5 file: not supported" },
    #[cfg(not(feature = "dicom"))]
    Refusal {
        probe: |c| only(Magic, c.has_entry("DICOMDIR")),
        says: "is a directory of DICOM files: this build was made without the feature `dicom`, convert the series to NRRD or NIfTI",
    },
    Refusal {
        probe: |c| only(Magic, [".zgroup", ".zarray", "zarr.json"].iter().any(|name| c.has_entry(name))),
        says: "is a directory of Zarr arrays: not supported, save one array as .npy or NRRD and give that file",
    },
];

fn only(certainty: Certainty, holds: bool) -> Certainty {
    if holds { certainty } else { No }
}

fn is_tar(clues: &Clues) -> bool {
    clues.has(257, b"ustar")
}
