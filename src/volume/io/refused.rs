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

/// Files that tell a folder of Zarr.
#[cfg(not(feature = "zarr"))]
const ZARR: [&str; 3] = ["zarr.json", ".zarray", ".zgroup"];

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
    Refusal { probe: |c| only(Length, is_tar(c) && c.once), says: "a tar archive, which cannot be read from a pipe: give its file" },
    Refusal {
        probe: |c| only(Length, is_tar(c)),
        says: "a tar archive of no DICOM files: not supported, unpack it and name the volume file",
    },
    Refusal {
        // A VTK file starts like this too; its reader comes first.
        probe: |c| only(Magic, c.has(0, b"<?xml")),
        says: "an XML file: not supported (of XML, VTK's image data is read)",
    },
    Refusal {
        probe: |c| {
            only(Magic, cfg!(not(feature = "stacks")) && [&b"II*\0"[..], b"MM\0*", b"II+\0", b"MM\0+"].iter().any(|magic| c.has(0, magic)))
        },
        says: "a TIFF file: not supported by this build, which lacks the feature \"stacks\"",
    },
    Refusal { probe: |c| only(Magic, is_image(c)), says: ONE_IMAGE },
    Refusal { probe: |c| only(Magic, c.has(0, b"\x89HDF")), says: "an HDF5 file: not supported" },
    #[cfg(not(feature = "dicom"))]
    Refusal {
        probe: |c| only(Magic, c.has_entry("DICOMDIR")),
        says: "is a directory of DICOM files: this build was made without the feature `dicom`, convert the series to NRRD or NIfTI",
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

/// What is said of an image that is a file by itself.
const ONE_IMAGE: &str = if cfg!(feature = "stacks") {
    "one image, not a volume: give the folder that its slices are in"
} else {
    "an image: stacks of images are not supported by this build, which lacks the feature \"stacks\""
};

/// Whether a file is a PNG, JPEG, BMP or PNM image.
fn is_image(clues: &Clues) -> bool {
    // A BMP file says how long its second header is.
    let is_bmp = clues.has(0, b"BM") && clues.head.get(15..18) == Some(&[0; 3]);
    let is_pnm = matches!(clues.head, [b'P', b'1'..=b'6', b' ' | b'\t' | b'\r' | b'\n', ..]);
    is_bmp || is_pnm || clues.has(0, b"\x89PNG\r\n\x1a\n") || clues.has(0, b"\xff\xd8\xff")
}

fn is_tar(clues: &Clues) -> bool {
    clues.has(257, b"ustar")
}
