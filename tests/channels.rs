//! Volumes of colours and of labels: what they hold, what they refuse, and that nobody takes a colour for a value. And voxels in
//! memory that somebody else owns.

#![cfg(all(feature = "explain", feature = "study"))]
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use glam::DVec3;
use slicestack::scene::{Scene, Slicing, TransferFunction};
use slicestack::volume::{Buffer, Channels, Colors, Grid, Segment, VoxelType, Voxels};
use slicestack::{Renderer, Settings, Volume, explain, reference, render, study};
use std::sync::Arc;

const DIMS: [usize; 3] = [6, 5, 4];
const COUNT: usize = 120;

fn grid() -> Grid {
    Grid::with_spacing(DIMS, [1.0, 1.0, 2.0]).unwrap()
}

fn colors() -> Volume {
    Volume::with_colors(grid(), (0..4 * COUNT).map(|i| (i % 256) as u8).collect::<Vec<_>>().into()).unwrap()
}

fn labels() -> Voxels {
    (0..COUNT).map(|i| (i % 4) as u16).collect::<Vec<_>>().into()
}

fn scene() -> Scene {
    let transfer = TransferFunction::new(vec![(0.0, [1.0, 0.3, 0.1]), (3.0, [0.2, 0.8, 1.0])], vec![(0.0, 0.0), (3.0, 0.4)]);
    Scene::new(transfer.unwrap()).with_size(40, 30).unwrap().with_slices(Slicing::Count(30)).unwrap()
}

#[track_caller]
fn refused<T>(result: slicestack::Result<T>, words: &[&str]) {
    let line = result.err().unwrap().to_string();
    assert!(!line.contains('\n') && words.iter().all(|w| line.contains(w)), "{line}");
}

#[test]
fn colours_are_four_numbers_of_their_type() {
    let v = colors();
    assert_eq!((v.channels(), v.channels().count(), v.grid()), (&Channels::Rgba, 4, &grid()));
    let Some(Colors::U8(bytes)) = v.colors() else { panic!("colours of u8") };
    assert_eq!((bytes.len(), bytes[0], bytes[64]), (COUNT, [0, 1, 2, 3], [0, 1, 2, 3]));
    assert_eq!(v.colors().unwrap().get(1), [4, 5, 6, 7].map(|c| f64::from(c) / 255.0));

    let words = Volume::with_colors(grid(), vec![65535u16; 4 * COUNT].into()).unwrap();
    assert_eq!((words.colors().unwrap().len(), words.colors().unwrap().get(COUNT - 1)), (COUNT, [1.0; 4]));
    let floats = Volume::with_colors(grid(), vec![0.25f32; 4 * COUNT].into()).unwrap();
    let Some(Colors::F32(f)) = floats.colors() else { panic!("colours of f32") };
    assert_eq!((f[7], floats.colors().unwrap().get(7)), ([0.25; 4], [0.25; 4]));
    // Scalars have no colours.
    assert_eq!(Volume::new(grid(), labels()).unwrap().colors(), None);
}

#[test]
fn counts_and_types_are_checked() {
    refused(Volume::with_colors(grid(), vec![0u8; COUNT].into()), &["120 numbers", "6 x 5 x 4 = 120 voxels of 4"]);
    refused(Volume::with_colors(grid(), vec![0u8; 4 * COUNT + 1].into()), &["481 numbers"]);
    refused(Volume::new(grid(), vec![0u8; 4 * COUNT].into()), &["480 voxels", "= 120"]);
    for kind in VoxelType::ALL {
        let made = Volume::with_colors(grid(), Voxels::zeros(kind, 4 * COUNT));
        if matches!(kind, VoxelType::U8 | VoxelType::U16 | VoxelType::F32) {
            made.unwrap();
        } else {
            refused(made, &[kind.name(), "u8, u16 and f32"]);
        }
    }
    // A grid of which four times as many voxels overflow.
    let vast = Grid::with_spacing([1 << 24, 1 << 24, 1 << 14], [1.0; 3]).unwrap();
    refused(Volume::with_colors(vast, vec![0u8; 4].into()), &["4 numbers"]);
}

#[test]
fn a_colour_is_no_value() {
    let v = colors();
    assert_eq!((v.scalars(), v.voxels().len(), v.voxels().voxel_type()), (None, 0, VoxelType::U8));
    assert!(v.value([1, 2, 3]).is_nan() && v.sample(DVec3::ONE).is_nan() && v.gradient(DVec3::ONE).is_nan());
    let s = v.statistics();
    assert_eq!((s.histogram.iter().sum::<u64>(), s.non_finite, s.min, s.max), (0, 0, 0.0, 0.0));
    refused(v.clone().with_rescale(2.0, 0.0), &["slope 2", "colours"]);
    refused(v.with_segments(Vec::new()), &["labels of voxels that are colours"]);
}

#[test]
fn colours_keep_what_they_are_on_another_grid() {
    let v = colors().with_name("c").with_grid(Grid::with_spacing([5, 6, 4], [3.0; 3]).unwrap()).unwrap();
    assert_eq!((v.channels(), v.colors(), v.name()), (&Channels::Rgba, colors().colors(), "c"));
    assert_eq!(v.grid().dims(), [5, 6, 4]);
    refused(v.with_grid(Grid::with_spacing([5, 6, 16], [3.0; 3]).unwrap()), &["480 numbers", "480 voxels of 4"]);
    // Scalars keep theirs too, and the bricks are those of the new grid.
    let v = Volume::new(grid(), labels()).unwrap().with_rescale(2.0, 1.0).unwrap();
    let first = render(&v, &scene()).unwrap();
    let turned = v.with_grid(Grid::with_spacing([4, 5, 6], [1.0; 3]).unwrap()).unwrap();
    assert_eq!((turned.rescale(), turned.value([1, 0, 0])), ((2.0, 1.0), 3.0));
    assert!(render(&turned, &scene()).unwrap() != first);
}

#[test]
fn colours_without_alpha_are_colours_of_another_kind() {
    let (v, rgb) = (colors(), colors().without_alpha().unwrap());
    assert_eq!((rgb.channels(), rgb.channels().count(), rgb.channels().is_color()), (&Channels::Rgb, 4, true));
    assert!(v.channels().is_color() && !Channels::Scalar.is_color() && !Channels::Label(Vec::new()).is_color());
    assert_eq!((rgb.colors(), rgb.scalars()), (v.colors(), None));
    // They look different, so they are different volumes.
    assert!(rgb.sha256() != v.sha256());
    let moved = rgb.with_grid(Grid::with_spacing([5, 6, 4], [3.0; 3]).unwrap()).unwrap();
    assert_eq!(moved.channels(), &Channels::Rgb);
}

#[test]
fn what_needs_values_refuses_colours() {
    let v = colors().with_name("tissue.nrrd");
    let says = |what: &'static str| [what, "tissue.nrrd: ", "needs one number a voxel"];
    refused(explain::explain(&v, &scene(), &Settings::default(), &explain::Request::default()), &says("the teaching page"));
    refused(study::study(&v, &scene(), &study::Options::default()), &says("a report"));
    refused(reference::Prover::new(&scene(), &v), &says("bounds of rays"));
    let blend = scene().with_levels(vec![slicestack::scene::LevelSurface::new(1.0, None, 1.0).unwrap()]).unwrap();
    refused(reference::SurfaceTracer::new(&blend, &v), &says("level surfaces"));
    refused(reference::image(&blend, &v, reference::Region::whole(&blend)), &says("level surfaces"));
    let parts = [0..5, 0..4, 0..3];
    let domain = slicestack::proxy::Domain::new(grid(), parts, [0..6, 0..5, 0..4], (0.0, 1.0), 0).unwrap();
    let part = Renderer::new(&v, Settings::default()).render_part(&scene(), &domain);
    refused(part, &says("a part of a volume"));
    // What does not, renders them.
    assert!(render(&v, &scene()).unwrap().pixel(20, 15)[3] > 0.1);
    assert!(Renderer::new(&v, Settings::default()).render_layer(&scene()).is_ok());
    assert!(reference::Integrator::new(&scene(), &v).is_ok());
}

#[test]
fn labels_have_names_and_render_as_scalars() {
    let segments = vec![Segment::new(2, "liver").with_color([0.8, 0.3, 0.2]), Segment::new(3, "spleen")];
    let v = Volume::new(grid(), labels()).unwrap().with_segments(segments.clone()).unwrap();
    assert_eq!((v.channels(), v.channels().count()), (&Channels::Label(segments.clone()), 1));
    assert_eq!(v.channels().segment(2), Some(&segments[0]));
    assert_eq!((v.channels().segment(1), Channels::Scalar.segment(2), Channels::Rgba.segment(2)), (None, None, None));
    assert_eq!(Channels::Rgb.segment(2), None);
    assert_eq!((v.scalars(), v.colors(), v.value([3, 0, 0])), (Some(&labels()), None, 3.0));
    let plain = Volume::new(grid(), labels()).unwrap();
    let picture = render(&v, &scene()).unwrap();
    assert!(picture == render(&plain, &scene()).unwrap() && picture.pixel(20, 15)[3] > 0.1);
    let regridded = v.with_grid(Grid::with_spacing([5, 6, 4], [1.0; 3]).unwrap()).unwrap();
    assert_eq!(regridded.channels(), &Channels::Label(segments));
}

#[test]
fn segments_are_checked() {
    let with = |kind, segments: &[Segment]| Volume::new(grid(), Voxels::zeros(kind, COUNT)).unwrap().with_segments(segments.to_vec());
    let one = |value| [Segment::new(value, "liver")];
    refused(with(VoxelType::F32, &one(1)), &["f32", "integer"]);
    refused(with(VoxelType::F64, &[]), &["f64"]);
    refused(with(VoxelType::U8, &one(256)), &["liver", "256", "u8"]);
    refused(with(VoxelType::U32, &one(-1)), &["-1", "u32"]);
    refused(with(VoxelType::I32, &one(1 << 31)), &["2147483648", "i32"]);
    refused(with(VoxelType::I16, &[Segment::new(1, "a"), Segment::new(1, "b")]), &["\"a\"", "\"b\"", "label 1"]);
    refused(with(VoxelType::I8, &[Segment::new(1, "a").with_color([0.0, 1.5, 0.0])]), &["\"a\"", "1.5"]);
    refused(with(VoxelType::I8, &[Segment::new(1, "a").with_color([f64::NAN, 0.0, 0.0])]), &["NaN"]);
    for (kind, value) in [(VoxelType::U8, 255), (VoxelType::I8, -128), (VoxelType::U32, u32::MAX.into()), (VoxelType::I32, i32::MIN.into())]
    {
        with(kind, &one(value)).unwrap();
    }
    let rescaled = Volume::new(grid(), labels()).unwrap().with_rescale(2.0, 0.0).unwrap();
    refused(rescaled.with_segments(Vec::new()), &["slope 2"]);
    let named = with(VoxelType::U8, &one(1)).unwrap();
    refused(named.clone().with_rescale(1.0, 5.0), &["intercept 5", "labels"]);
    assert_eq!(named.with_rescale(1.0, 0.0).unwrap().rescale(), (1.0, 0.0));
}

/// Numbers that belong to another program, as an array of NumPy does.
struct Foreign(Box<[f32]>);

impl AsRef<[f32]> for Foreign {
    fn as_ref(&self) -> &[f32] {
        &self.0
    }
}

#[test]
fn voxels_of_another_owner_are_rendered_where_they_lie() {
    let owner = Arc::new(Foreign((0..COUNT).map(|i| (i * 7 % 31) as f32 / 10.0).collect()));
    let first = owner.0.as_ptr();
    let volume = Volume::new(grid(), Voxels::F32(Buffer::shared(owner.clone()))).unwrap();
    let lies = |volume: &Volume| matches!(volume.voxels(), Voxels::F32(v) if v.is_shared() && v.as_ptr() == first);
    let copy = Volume::new(grid(), owner.0.to_vec().into()).unwrap();
    assert!(lies(&volume) && lies(&volume.clone()) && !lies(&copy));
    let picture = render(&volume, &scene()).unwrap();
    assert!(picture == render(&copy, &scene()).unwrap() && picture.pixel(20, 15)[3] > 0.1);
    assert_eq!(volume.statistics(), copy.statistics());
    assert!(lies(&volume), "rendering copies nothing");
    // Colours may lie there as well.
    let colors = Arc::new(vec![9u8; 4 * COUNT]);
    let volume = Volume::with_colors(grid(), Voxels::U8(Buffer::shared(colors.clone()))).unwrap();
    assert!(matches!(volume.colors(), Some(Colors::U8(c)) if c.as_ptr().cast() == colors.as_ptr()));
}
