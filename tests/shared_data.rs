//! Real files, opened with exactly the numbers that are known of them.
//!
//! The files are looked for in `$SLICESTACK_DATA`, else in `../shared/data` beside the package. They are too large to be part of
//! it: where they are absent each test says so, and fails when run in continuous integration (`$CI` is set).

#![cfg(feature = "formats")]
#![allow(clippy::unwrap_used, reason = "a test that cannot read or write its file shall stop")]

use glam::{DAffine3, DMat3, DVec3};
use slicestack::reference::{Integrator, Prover};
use slicestack::scene::preset::{Guess, Kind};
use slicestack::scene::{Camera, Preset, TransferFunction};
use slicestack::volume::io::{self, Choice, Endian, Format, RawSpec, Reading};
use slicestack::volume::{BoxConvention, Channels, Space, VoxelType};
use slicestack::{Limits, Scene, Volume};
use std::path::{Path, PathBuf};

fn data(file: &str) -> Option<PathBuf> {
    let root =
        std::env::var_os("SLICESTACK_DATA").map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let path = root.join(file);
    if path.is_file() {
        return Some(path);
    }
    eprintln!("data absent: {}", path.display());
    assert!(std::env::var_os("CI").is_none(), "data absent: {}", path.display());
    None
}

/// What is known of a file. The means were computed apart from this crate, from the files' bytes.
struct Known {
    dims: [usize; 3],
    kind: VoxelType,
    range: [f64; 2],
    mean: f64,
    spacing: [f64; 3],
    space: Space,
}

fn check(volume: &Volume, known: &Known) {
    let name = volume.name();
    let statistics = volume.statistics();
    assert_eq!(volume.grid().dims(), known.dims, "{name}");
    assert_eq!(volume.voxels().voxel_type(), known.kind, "{name}");
    assert_eq!([statistics.min, statistics.max], known.range, "{name}");
    assert!((statistics.mean - known.mean).abs() < 1e-9, "{name}: mean {} for {}", statistics.mean, known.mean);
    assert_eq!(statistics.non_finite, 0, "{name}");
    for (have, want) in volume.grid().spacing().into_iter().zip(known.spacing) {
        assert!((have - want).abs() < 1e-9 * want, "{name}: spacing {have} for {want}");
    }
    assert_eq!(volume.grid().space(), known.space, "{name}");
    assert_eq!(volume.rescale(), (1.0, 0.0), "{name}");
}

/// The grid's axes as unit vectors and its origin.
fn stands(volume: &Volume, axes: [[f64; 3]; 3], origin: [f64; 3]) {
    let directions = volume.grid().directions();
    let want = DMat3::from_cols_array_2d(&axes);
    assert!(directions.abs_diff_eq(want, 1e-12), "{}: directions {directions}", volume.name());
    let have = volume.grid().origin();
    assert!(have.abs_diff_eq(DVec3::from_array(origin), 1e-6), "{}: origin {have}", volume.name());
}

const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn open(file: &str, format: Format) -> Option<Volume> {
    let path = data(file)?;
    assert_eq!(io::detect(&path).unwrap(), format, "{file}");
    let volume = Volume::open(&path).unwrap();
    assert_eq!(volume.name(), path.display().to_string());
    Some(volume)
}

#[test]
fn abdomen_ct_in_hounsfield_units() {
    let Some(v) = open("abdomen_ct_nifti/example_ct.nii.gz", Format::Nifti) else { return };
    check(
        &v,
        &Known {
            dims: [122, 101, 112],
            kind: VoxelType::I32,
            range: [-1207.0, 3382.0],
            mean: -360.0203852864795,
            spacing: [3.0; 3],
            space: Space::Ras,
        },
    );
    stands(
        &v,
        AXES,
        [f64::from(f32::from_bits(0xc331_f4d2)), f64::from(f32::from_bits(0x4135_1aa0)), f64::from(f32::from_bits(0x42bc_9a80))],
    );
}

#[test]
fn big_endian_nifti() {
    let Some(v) = open("avg152t1_nifti_be/avg152T1_RL_nifti.nii.gz", Format::Nifti) else { return };
    check(
        &v,
        &Known {
            dims: [91, 109, 91],
            kind: VoxelType::U8,
            range: [0.0, 255.0],
            mean: 82.89716151375593,
            spacing: [2.0; 3],
            space: Space::Ras,
        },
    );
    stands(&v, AXES, [-90.0, -126.0, -72.0]);
    // The box by hand from the header: half a voxel of 2 mm around centres from -90, -126, -72.
    let corners = v.grid().corners();
    assert_eq!(corners[0], DVec3::new(-91.0, -127.0, -73.0));
    assert_eq!(corners[7], DVec3::new(91.0, 91.0, 109.0));
}

#[test]
fn bonsai() {
    let Some(v) = open("bonsai/bonsai.nii.gz", Format::Nifti) else { return };
    check(
        &v,
        &Known { dims: [256; 3], kind: VoxelType::U8, range: [0.0, 255.0], mean: 13.4647576212883, spacing: [1.0; 3], space: Space::Ras },
    );
    stands(&v, AXES, [-127.0, -127.0, -128.0]);
}

#[test]
fn mni152_brain() {
    let Some(v) = open("mni152/mni_icbm152_t1_tal_nlin_sym_09a_converted.nii.gz", Format::Nifti) else { return };
    check(
        &v,
        &Known {
            dims: [197, 233, 189],
            kind: VoxelType::U8,
            range: [0.0, 255.0],
            mean: 38.438930276559084,
            spacing: [1.0; 3],
            space: Space::Ras,
        },
    );
    stands(&v, AXES, [-98.0, -134.0, -72.0]);
}

#[test]
fn anisotropic_nrrd() {
    let Some(v) = open("brain1_nrrd/brain1_image.nrrd", Format::Nrrd) else { return };
    check(
        &v,
        &Known {
            dims: [256, 256, 25],
            kind: VoxelType::I16,
            range: [0.0, 3057.0],
            mean: 385.6564080810547,
            spacing: [0.78125, 0.78125, 6.5],
            space: Space::Lps,
        },
    );
    stands(&v, [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]], [-99.609375, 99.609375, -78.0]);
}

#[test]
#[allow(clippy::excessive_precision, reason = "the digits are those of the file's header")]
fn oblique_nrrd() {
    let Some(v) = open("flair_nrrd/FLAIR.nrrd", Format::Nrrd) else { return };
    check(
        &v,
        &Known {
            dims: [124, 160, 140],
            kind: VoxelType::U8,
            range: [0.0, 255.0],
            mean: 41.48604766705069,
            spacing: [1.0; 3],
            space: Space::Lps,
        },
    );
    // The header's own numbers.
    let a = [-0.99359200921208746, 0.04970492721885441, -0.10151029228632795];
    let b = [-0.016005020190061219, -0.95093665139041228, -0.30897139733494045];
    let c = [-0.11188725988575336, -0.30536684015686016, 0.94563858529983524];
    let o = [64.898239135742202, 110.4311447143555, -27.92553901672364];
    let at = |i: f64, j: f64, k: f64| DVec3::from_array(std::array::from_fn(|x| o[x] + i * a[x] + j * b[x] + k * c[x]));
    for (convention, low, high) in
        [(BoxConvention::Cells, [-0.5; 3], [123.5, 159.5, 139.5]), (BoxConvention::Nodes, [0.0; 3], [123.0, 159.0, 139.0])]
    {
        let corners = v.grid().clone().with_convention(convention).corners();
        for (n, corner) in corners.into_iter().enumerate() {
            let pick = |axis: usize| if n >> axis & 1 == 1 { high[axis] } else { low[axis] };
            let want = at(pick(0), pick(1), pick(2));
            assert!(corner.distance(want) < 1e-10, "corner {n}: {corner} for {want}");
        }
    }
}

#[test]
fn detached_nrrd() {
    let Some(v) = open("nucleon/nucleon.nrrd", Format::Nrrd) else { return };
    check(
        &v,
        &Known {
            dims: [41; 3],
            kind: VoxelType::U8,
            range: [0.0, 249.0],
            mean: 39.39765818836059,
            spacing: [1.0; 3],
            space: Space::Unknown,
        },
    );
    assert_eq!(v.grid().index_to_world(), DAffine3::IDENTITY);
}

#[test]
fn gzipped_big_endian_raw() {
    let Some(path) = data("cthead/CThead_256x256x113_int16be.raw.gz") else { return };
    let spec = RawSpec::new([256, 256, 113], VoxelType::I16).with_endian(Endian::Big).with_spacing([1.0, 1.0, 2.0]);
    let v = io::read_raw(&path, &spec, &Limits::default()).unwrap();
    check(
        &v,
        &Known {
            dims: [256, 256, 113],
            kind: VoxelType::I16,
            range: [0.0, 3272.0],
            mean: 379.54205457299156,
            spacing: [1.0, 1.0, 2.0],
            space: Space::Unknown,
        },
    );
}

#[test]
fn raw() {
    let Some(path) = data("fuel/fuel_64x64x64_uint8.raw") else { return };
    let v = io::read_raw(&path, &RawSpec::new([64; 3], VoxelType::U8), &Limits::default()).unwrap();
    check(
        &v,
        &Known {
            dims: [64; 3],
            kind: VoxelType::U8,
            range: [0.0, 255.0],
            mean: 1.9447898864746094,
            spacing: [1.0; 3],
            space: Space::Unknown,
        },
    );
}

#[test]
fn metaimage() {
    let Some(v) = open("headmr_mhd/HeadMRVolume.mhd", Format::MetaImage) else { return };
    check(
        &v,
        &Known {
            dims: [48, 62, 42],
            kind: VoxelType::U8,
            range: [0.0, 255.0],
            mean: 24.46822196620584,
            spacing: [4.0; 3],
            space: Space::Unknown,
        },
    );
    stands(&v, AXES, [0.0; 3]);
}

#[test]
fn structured_points() {
    let Some(v) = open("ironprot_vtk/ironProt.vtk", Format::Vtk) else { return };
    check(
        &v,
        &Known {
            dims: [68; 3],
            kind: VoxelType::U8,
            range: [0.0, 255.0],
            mean: 13.138258828617952,
            spacing: [1.0; 3],
            space: Space::Unknown,
        },
    );
    assert_eq!(v.grid().index_to_world(), DAffine3::IDENTITY);
}

#[test]
fn numpy_archive() {
    let Some(v) = open("stent/stent.npz", Format::Npz) else { return };
    check(
        &v,
        &Known {
            dims: [128, 128, 256],
            kind: VoxelType::I16,
            range: [0.0, 2000.0],
            mean: 35.39822244644165,
            spacing: [1.0; 3],
            space: Space::Unknown,
        },
    );
}

#[cfg(feature = "dicom")]
#[test]
fn chest_ct_out_of_an_archive_of_dicom_files() {
    let Some(volume) = open("lidc_chest_dicom/LIDC-IDRI-0314_every6th.tar.gz", Format::Dicom) else { return };
    let (statistics, grid) = (volume.statistics(), volume.grid());
    assert_eq!((grid.dims(), volume.voxels().voxel_type(), grid.space()), ([512, 512, 46], VoxelType::U16, Space::Lps));
    assert_eq!((statistics.min, statistics.max, volume.rescale()), (-1000.0, 1841.0, (1.0, -1000.0)));
    assert!((statistics.mean + 1000.0 - 380.09).abs() < 0.005, "{}", statistics.mean);
    // The slice thickness in the files is 1 mm, positions tell that six times that lies between.
    assert!(grid.spacing().into_iter().zip([0.78125, 0.78125, 6.0]).all(|(a, b)| (a - b).abs() < 1e-9), "{:?}", grid.spacing());
    stands(&volume, AXES, [-201.0, -59.0, -679.800049]);
    assert_eq!(volume.modality(), slicestack::volume::Modality::Ct);
    assert!(volume.notes().is_empty(), "{:?}", volume.notes());
}

/// What each volume is taken for, and begins with: decided by header, values and axes.
#[test]
fn what_volumes_are_taken_for() {
    for (file, kind, preset) in [
        ("abdomen_ct_nifti/example_ct.nii.gz", Kind::Hounsfield, Preset::CtBone),
        ("avg152t1_nifti_be/avg152T1_RL_nifti.nii.gz", Kind::Mr, Preset::MrBrain),
        ("mni152/mni_icbm152_t1_tal_nlin_sym_09a_converted.nii.gz", Kind::Mr, Preset::MrBrain),
        ("brain1_nrrd/brain1_image.nrrd", Kind::Mr, Preset::MrBrain),
        ("flair_nrrd/FLAIR.nrrd", Kind::Mr, Preset::MrBrain),
        ("bonsai/bonsai.nii.gz", Kind::Other, Preset::HotRamp),
        ("nucleon/nucleon.nrrd", Kind::Other, Preset::HotRamp),
        ("headmr_mhd/HeadMRVolume.mhd", Kind::Other, Preset::HotRamp),
        ("ironprot_vtk/ironProt.vtk", Kind::Other, Preset::HotRamp),
        ("stent/stent.npz", Kind::HounsfieldCut, Preset::HotRamp),
        ("../cases/preset-ct-padded.nii.gz", Kind::Hounsfield, Preset::CtBone),
        ("../cases/preset-mr-with-ringing.nii.gz", Kind::Mr, Preset::MrBrain),
    ] {
        let Some(path) = data(file) else { continue };
        let volume = io::read(path, &Limits::new()).unwrap();
        let guess = Guess::of(&volume);
        assert_eq!((guess.kind, guess.preset), (kind, preset), "{file}: {}", guess.reason);
        assert!(!guess.reason.is_empty() && !guess.reason.contains('\n'));
        assert_eq!(guess.advice.is_some(), kind == Kind::HounsfieldCut, "{file}");
    }
    // A raw file of CT with 1024 added is told; with the offset it is CT.
    let Some(path) = data("cthead/CThead_256x256x113_int16be.raw.gz") else { return };
    let spec = RawSpec::new([256, 256, 113], VoxelType::I16).with_endian(Endian::Big);
    let stored = io::read_raw(path, &spec, &Limits::new()).unwrap();
    let guess = Guess::of(&stored);
    assert_eq!(guess.kind, Kind::HounsfieldPlus1024, "{}", guess.reason);
    assert!(guess.advice.is_some_and(|a| a.contains("volume.intercept = -1024")));
    assert_eq!(Guess::of(&stored.with_rescale(1.0, -1024.0).unwrap()).preset, Preset::CtBone);
}

#[test]
fn a_heads_pixels_are_enclosed() {
    let Some(path) = data("cthead/CThead_256x256x113_int16be.raw.gz") else { return };
    let spec = RawSpec::new([256, 256, 113], VoxelType::I16).with_endian(Endian::Big).with_spacing([1.0, 1.0, 2.0]);
    let volume = io::read_raw(path, &spec, &Limits::new()).unwrap();
    let bone = vec![(0.0, [0.0; 3]), (1216.0, [1.0, 0.9, 0.8]), (1600.0, [1.0, 1.0, 0.95]), (4080.0, [1.0; 3])];
    let bone = TransferFunction::new(bone, vec![(1216.0, 0.0), (1600.0, 0.5), (4080.0, 0.9)]).unwrap();
    for camera in [Camera::orbit(30.0, 20.0).unwrap(), Camera::orbit(0.0, 0.0).unwrap()] {
        // From in front, a pixel for each voxel: rays lie on the cells' faces but for rounding.
        let scene = Scene::new(bone.clone()).with_camera(camera).with_size(256, 256).unwrap();
        let (prover, integrator) = (Prover::new(&scene, &volume).unwrap(), Integrator::new(&scene, &volume).unwrap());
        let mut shown = 0;
        for i in 0..200 {
            let (x, y) = (i * 37 % 256, i * 101 % 256);
            let (bounds, (color, ray)) = (prover.pixel(x, y, 1e-4), integrator.pixel(x, y));
            assert!(bounds.width <= 1e-4, "{x},{y}: {bounds:?}");
            let off = ray.error_bound + 1e-11;
            for (c, [lo, hi]) in color.rgb.iter().zip(bounds.pixel) {
                assert!(lo - off <= *c && *c <= hi + off, "{x},{y}: {c} {bounds:?}");
            }
            shown += u32::from(bounds.transmittance[1] < 0.9);
        }
        assert!(shown > 20, "{shown}");
    }
}

/// Small files that were once read wrongly, and what they hold.
#[test]
fn odd_files_are_read_right() {
    let open = |file: &str, choice: Choice| Some(io::read_as(data(&format!("../cases/{file}"))?, &Reading::new().choice(choice)).unwrap());
    let none = Choice::new;
    if let Some(v) = open("nrrd-rgb-2d.nrrd", none()) {
        assert_eq!((v.grid().dims(), v.channels()), ([9, 8, 1], &Channels::Rgb));
    }
    if let Some(v) = open("nrrd-spacings-directions-none.nrrd", none()) {
        assert_eq!((v.grid().spacing(), v.grid().space()), ([2.0, 2.0, 5.0], Space::Ras));
    }
    for file in ["nrrd-gzip-byteskip.nhdr", "nrrd-percent.nhdr"] {
        if let Some(v) = open(file, none()) {
            assert_eq!((v.grid().dims(), v.voxels().voxel_type()), ([4, 5, 6], VoxelType::I16), "{file}");
        }
    }
    if let Some(v) = open("nifti-dim4-zero.nii", none()) {
        assert_eq!((v.grid().dims(), v.notes().iter().any(|n| n.contains("dim[4] is 0"))), ([4, 5, 6], true));
    }
    if let Some(v) = open("nifti-sform-zero.nii", none()) {
        assert_eq!((v.grid().spacing(), v.grid().space()), ([2.0, 3.0, 4.0], Space::Ras));
        assert!(v.notes().iter().any(|n| n.contains("the sform cannot be used") && n.contains("the qform is taken")), "{:?}", v.notes());
    }
    for file in ["vtk-field-before-dimensions.vtk", "vtk-blank-line.vtk"] {
        if let Some(v) = open(file, none()) {
            assert_eq!((v.grid().dims(), v.value([3, 2, 1])), ([4, 3, 2], 23.0), "{file}");
        }
    }
    if let Some(v) = open("vtk-color-scalars.vtk", none()) {
        assert_eq!((v.grid().dims(), v.channels()), ([4, 3, 2], &Channels::Rgb));
        let red = open("vtk-color-scalars.vtk", none().channel(0)).unwrap();
        assert_eq!(red.value([1, 0, 0]), v.colors().unwrap().get(1)[0] * 255.0);
    }
}
