//! How a surface comes to look solid, in five steps: white where there is something, darker with depth, lit at samples, lit where the surface
//! is, and one surface seen through another.
//!
//! ```sh
//! cargo run --release --example classroom -- FOLDER
//! ```
//! Writes `classroom-1-threshold.png` to `classroom-5-skin-over-bone.png`: of the CT head that lies beside the repository, or of the built-in
//! head where that is not there.

use slicestack::picture::Depth;
use slicestack::scene::{
    Camera, Gradient, Hit, LevelSurface, Light, LightSource, Lighting, Placement, Projection, Shading, Slicing, Straight, TransferFunction,
};
use slicestack::volume::VolumeSource;
use slicestack::volume::phantom::Phantom;
use slicestack::{Limits, Renderer, Result, Scene, Settings, Volume};
use std::path::{Path, PathBuf};

/// What is looked at: values of the outer and of the inner surface, data units.
struct Subject {
    volume: Volume,
    skin: f64,
    bone: f64,
}

/// The CT head of 256 x 256 x 113 voxels, values in Hounsfield units.
fn ct_head(file: &Path) -> Result<Subject> {
    let text = format!(
        "[volume]\npath = {file:?}\ndimensions = [256, 256, 113]\ntype = \"i16\"\nendian = \"big\"\nspacing = [1, 1, -2]\nintercept = -1024\n"
    );
    let source: VolumeSource = slicestack::scene::SceneFile::parse(&text, ".", &Default::default())?.volume().clone();
    Ok(Subject { volume: source.load(&Limits::default())?, skin: -400.0, bone: 300.0 })
}

/// The built-in head: a skull of 1 around values of about 0.2.
fn built_in_head() -> Result<Subject> {
    Ok(Subject { volume: Phantom::SheppLogan.volume(128)?, skin: 0.1, bone: 0.6 })
}

/// A scene of surfaces seen from the front and a little above.
fn scene(slices: u64, levels: Vec<LevelSurface>) -> Result<Scene> {
    let camera =
        Camera::new(Placement::Orbit { azimuth: -38.0, elevation: 8.0, roll: 0.0, zoom: 1.5 }, Projection::Perspective { fov_y: 25.0 })?;
    // Every surface has a colour of its own, so the transfer function does not matter.
    let plain = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 1.0)])?;
    Scene::new(plain)
        .with_camera(camera)
        .with_size(384, 384)?
        .with_background(Straight { rgb: [0.0; 3], alpha: 1.0 })?
        .with_slices(Slicing::Count(slices))?
        .with_levels(levels)
}

pub(crate) fn run(folder: &Path, file: &Path) -> Result<()> {
    let subject = if file.exists() {
        ct_head(file)?
    } else {
        println!("{}: is not there; the built-in head is drawn instead", file.display());
        built_in_head()?
    };
    let surface = |level, color, opacity| LevelSurface::new(level, Some(color), opacity);
    let one = |slices, color| scene(slices, vec![surface(subject.skin, color, 1.0)?]);
    let (white, clay) = ([1.0; 3], [0.82, 0.8, 0.77]);
    let mut depth = Lighting::default();
    depth.shading = Shading::Depth;
    let lamp = Light::new(LightSource::Direction(glam::DVec3::new(-0.5, -0.8, 0.7)), [1.0; 3])?;
    let mut lit = Lighting::default().with_lights(vec![lamp])?;
    (lit.ambient, lit.diffuse, lit.specular, lit.shininess) = (0.2, 0.8, 0.25, 25.0);

    // Few slices: so that it shows where a ray is told to have met the surface.
    let few = 72;
    let both = vec![surface(subject.skin, [0.9, 0.62, 0.48], 0.5)?, surface(subject.bone, [1.0, 0.97, 0.88], 1.0)?];
    let steps = [
        // Is there anything along the ray? Yes or no.
        ("1-threshold", one(256, white)?.with_flat_surfaces(true)),
        // How far away is it? The nearer, the brighter: the first pictures that showed a shape.
        ("2-depth", one(256, white)?.with_lighting(Some(depth))?),
        // Which way does it face? The gradient of the values tells. Taken at the first sample inside, it makes rings.
        ("3-first-sample", one(few, clay)?.with_lighting(Some(lit.clone()))?.with_hit(Hit::FirstSample)),
        // The same slices, the same light; but the crossing between two samples is sought, and the gradient is taken there.
        ("4-refined", one(few, clay)?.with_lighting(Some(lit.clone()))?),
        // What lies behind? Each surface lets some light through.
        ("5-skin-over-bone", scene(512, both)?.with_lighting(Some(lit))?.with_gradient(Gradient::Sobel)),
    ];
    let mut renderer = Renderer::new(&subject.volume, Settings::default());
    for (name, scene) in steps {
        let path = folder.join(format!("classroom-{name}.png"));
        renderer.render(&scene)?.0.save(&path, Depth::Eight)?;
        println!("{}", path.display());
    }
    Ok(())
}

fn main() -> Result<()> {
    let folder = std::env::args_os().nth(1).map_or_else(|| ".".into(), PathBuf::from);
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/cthead/CThead_256x256x113_int16be.raw.gz");
    run(&folder, &beside)
}
