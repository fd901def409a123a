//! From voxel to voxel, and voxelized rays.

use crate::{PARALLEL, constant, directions, drawn, largest, looking, numbers, plain, rms, telling, with};
use glam::DVec3;
use slicestack::reference::{Region, image};
use slicestack::scene::{Algorithm, Camera, Connectivity, Filter, Method, Projection, TemplatePlane, TransferFunction};
use slicestack::volume::phantom::Phantom;
use slicestack::{Scene, Volume};

const SIX: Algorithm = Algorithm::Traversal(Connectivity::Six);
const TEMPLATE: Algorithm = Algorithm::Template(TemplatePlane::Base);

fn own(scene: Scene) -> Scene {
    scene.with_method(Method::default().with_filter(Filter::Nearest)).unwrap()
}

/// The exact integral of the field that has each voxel's value all over its cell: the ray against every one of these boxes.
fn by_hand(volume: &Volume, scene: &Scene) -> Vec<[f64; 4]> {
    let (width, height) = scene.size();
    let view = scene.camera().resolve(volume.grid(), width, height).unwrap();
    let unit = volume.grid().smallest_spacing();
    let [nx, ny, nz] = volume.grid().dims();
    let mut pixels = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let (origin, direction) = view.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let at = volume.grid().world_to_index().transform_point3(origin);
            let step = volume.grid().world_to_index().transform_vector3(direction);
            let mut pieces = Vec::new();
            for voxel in 0..nx * ny * nz {
                let index = [voxel % nx, voxel / nx % ny, voxel / nx / ny];
                let (mut near, mut far) = (view.near, f64::INFINITY);
                for axis in 0..3 {
                    let (low, high) = (index[axis] as f64 - 0.5, index[axis] as f64 + 0.5);
                    if step[axis] == 0.0 {
                        // Along a face it belongs to the voxel of the higher index.
                        if at[axis] < low || at[axis] >= high {
                            far = f64::NEG_INFINITY;
                        }
                        continue;
                    }
                    let (a, b) = ((low - at[axis]) / step[axis], (high - at[axis]) / step[axis]);
                    (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
                }
                if far > near {
                    pieces.push((near, (far - near) * direction.length(), volume.value(index)));
                }
            }
            pieces.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (mut rgb, mut left) = ([0.0; 3], 1.0);
            for (_, length, value) in pieces {
                let color = scene.transfer().eval(value);
                let alpha = 1.0 - (1.0 - color.alpha).powf(length / unit);
                (0..3).for_each(|c| rgb[c] += left * alpha * color.rgb[c]);
                left *= 1.0 - alpha;
            }
            pixels.push([rgb[0], rgb[1], rgb[2], 1.0 - left]);
        }
    }
    pixels
}

#[test]
fn six_connected_rays_integrate_the_field_of_voxels_exactly() {
    let volume = numbers([7, 6, 8]);
    let mut cameras: Vec<Camera> = directions().into_iter().map(|eye| looking(eye, &volume, PARALLEL)).collect();
    cameras.push(looking(DVec3::new(9.0, 4.0, 6.0), &volume, Projection::Perspective { fov_y: 80.0 }));
    cameras.push(looking(DVec3::new(0.5, 0.6, 0.1), &volume, Projection::Perspective { fov_y: 80.0 }));
    for camera in cameras {
        let scene = with(&own(plain(telling(), 30, 1).with_camera(camera)), SIX);
        let difference = largest(&drawn(&volume, &scene), &by_hand(&volume, &scene));
        println!("{:?}: {difference:.1e}", camera.placement());
        assert!(difference < 2e-6, "{:?}: {difference}", camera.placement());
    }
}

#[test]
fn lengths_add_up_to_the_path_through_the_box() {
    let volume = numbers([7, 6, 8]);
    for eye in directions() {
        let scene = plain(constant(0.3), 30, 1).with_camera(looking(eye, &volume, PARALLEL));
        let truth = image(&scene, &volume, Region::whole(&scene)).unwrap();
        for connectivity in [Connectivity::Six, Connectivity::Eighteen, Connectivity::TwentySix] {
            let difference = largest(&drawn(&volume, &with(&scene, Algorithm::Traversal(connectivity))), truth.pixels());
            assert!(difference < 2e-6, "{connectivity:?} from {eye}: {difference}");
        }
    }
}

#[test]
fn values_in_the_middle_of_pieces_are_nearly_the_reference() {
    let volume = Phantom::Cloud.volume(32).unwrap();
    let transfer = TransferFunction::new(vec![(0.0, [0.1, 0.3, 1.0]), (1.0, [1.0, 0.4, 0.1])], vec![(0.0, 0.0), (1.0, 0.3)]).unwrap();
    let scene = plain(transfer, 40, 1).with_camera(looking(DVec3::new(30.0, 20.0, 14.0), &volume, Projection::Perspective { fov_y: 60.0 }));
    let truth = image(&scene, &volume, Region::whole(&scene)).unwrap();
    let error = |scene: &Scene, connectivity| rms(&drawn(&volume, &with(scene, Algorithm::Traversal(connectivity))), truth.pixels());
    let [six, eighteen, twenty_six] = [Connectivity::Six, Connectivity::Eighteen, Connectivity::TwentySix].map(|c| error(&scene, c));
    let blocks = error(&own(scene.clone()), Connectivity::Six);
    let steps = scene.clone().with_slices(slicestack::scene::Slicing::Count(64)).unwrap();
    let steps = rms(&drawn(&volume, &with(&steps, Algorithm::Rays)), truth.pixels());
    println!("64 equal steps: {steps:.1e}");
    println!("6: {six:.1e}, 18: {eighteen:.1e}, 26: {twenty_six:.1e}; voxels' own values: {blocks:.1e}");
    assert!(six < 3e-3 && eighteen < 4e-3 && twenty_six < 5e-3 && blocks > 3.0 * six);
}

#[test]
fn a_template_seen_straight_on_draws_what_voxelized_rays_draw_to_the_bit() {
    let volume = numbers([9, 6, 8]);
    for axis in 0..3 {
        for backwards in [false, true] {
            let camera = Camera::new(slicestack::scene::Placement::Along { axis, backwards }, PARALLEL).unwrap();
            let scene = own(plain(telling(), 41, 1).with_camera(camera));
            let voxelized = drawn(&volume, &with(&scene, Algorithm::Traversal(Connectivity::TwentySix)));
            assert_eq!(drawn(&volume, &with(&scene, TEMPLATE)), voxelized, "axis {axis}, backwards {backwards}");
            assert!(voxelized.iter().any(|p| p[3] > 0.5));
        }
    }
}

#[test]
fn a_template_is_near_to_voxelized_rays_from_the_base_plane_alone() {
    let volume = Phantom::Cloud.volume(32).unwrap();
    let transfer = TransferFunction::new(vec![(0.0, [0.1, 0.3, 1.0]), (1.0, [1.0, 0.4, 0.1])], vec![(0.0, 0.0), (1.0, 0.3)]).unwrap();
    let scene = own(plain(transfer, 64, 1).with_camera(looking(DVec3::new(30.0, 20.0, 14.0), &volume, PARALLEL)));
    let voxelized = drawn(&volume, &with(&scene, Algorithm::Traversal(Connectivity::TwentySix)));
    let away = |plane| rms(&drawn(&volume, &with(&scene, Algorithm::Template(plane))), &voxelized);
    let (base, wrong) = (away(TemplatePlane::Base), away(TemplatePlane::Image));
    println!("base plane {base:.1e}, image plane {wrong:.1e}");
    assert!(base < 0.02 && wrong > base, "{base}, {wrong}");
}
