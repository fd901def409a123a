//! `slicestack view --export`: the pictures of an orbit and the page that turns them, into a folder.

use super::movie::Frames;
use super::output::is_new_folder;
use super::progress::{Phase, enter};
use super::scene::{SceneArgs, load};
use super::{Usage, complain};
use anyhow::{Context, Result, bail};
use slicestack::picture::{Depth, Format, write_whole};
use slicestack::scene::{Camera, ResolvedScene};
use slicestack::view::export::{Page, START, Views, nearest_row, of_one_size, pictures_of, title_of};
use slicestack::{Progress, Renderer, Scene, Settings, Volume};
use std::fs;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The page's name in the folder.
const PAGE: &str = "index.html";

/// Where files wait until all of them are there.
const PART: &str = ".slicestack-export";

/// Writes the pictures of `views` and their page into `folder`. With `settings` the pictures are made.
///
/// # Errors
/// As reading, rendering and writing; for a folder that holds what no export has made.
pub(super) fn run(folder: &Path, views: Views, args: &SceneArgs, settings: Settings) -> Result<()> {
    let (text, overrides) = args.read()?;
    let folder = Folder::new(folder)?;
    let scene_file = text.open(&overrides)?;
    let volume = load(scene_file.volume(), &settings.limits)?;
    let ResolvedScene { scene, warnings, notes, .. } = scene_file.resolve(&volume)?;
    notes.iter().for_each(|note| complain("note", note));
    warnings.iter().for_each(|w| complain("warning", w));
    // A camera in the orbit form is fitted to what shows from all sides; one with an eye of its own keeps its distance and its size.
    let orbits = scene_file.turntable(&scene, &volume, 1).is_ok();
    let cameras = if orbits {
        let row = |elevation: &f64| -> Result<Vec<Camera>> {
            let mut overrides = overrides.clone();
            overrides.set("camera.elevation", elevation.to_string());
            Ok(text.open(&overrides)?.turntable(&scene, &volume, views.columns())?)
        };
        of_one_size(&views.elevations().iter().map(row).collect::<Result<Vec<_>>>()?)?
    } else {
        views.around(scene.camera(), volume.grid(), scene.size())?
    };
    let title =
        args.input.as_deref().and_then(Path::file_name).map_or_else(|| title_of(scene_file.volume()).into(), |name| name.to_string_lossy());
    let first_row = nearest_row(&cameras, scene.camera(), volume.grid(), scene.size())?;
    let page = Page { title: &title, views, size: scene.size(), first_row };

    folder.begin()?;
    enter(Phase::Streaming);
    let made = make(&folder, &page, &cameras, &scene, &volume, settings);
    if made.is_err() {
        folder.take_back();
    }
    let bytes = made?;
    enter(Phase::Idle);
    let count = cameras.iter().map(Vec::len).sum::<usize>();
    eprintln!("{}: {count} pictures, {bytes} bytes with the page; open it in a browser", folder.path.join(PAGE).display());
    Ok(())
}

/// Renders and writes everything, and tells how many bytes that is.
fn make(folder: &Folder, page: &Page<'_>, cameras: &[Vec<Camera>], scene: &Scene, volume: &Volume, settings: Settings) -> Result<u64> {
    let frames = Arc::new(Frames::new("view", cameras.iter().map(Vec::len).sum::<usize>() as u64));
    let mut renderer = Renderer::new(volume, settings.progress(Arc::clone(&frames) as Arc<dyn Progress>));
    let mut bytes = 0;
    let mut names = Vec::new();
    for (row, cameras) in cameras.iter().enumerate() {
        for (column, camera) in cameras.iter().enumerate() {
            let picture = renderer.render(&scene.clone().with_camera(*camera))?.0.encode(Format::WebP, Depth::Eight)?;
            let name = page.views.name(column, row);
            bytes += picture.len() as u64;
            write_whole(&folder.part().join(&name), &picture)?;
            names.push(name);
            frames.next();
        }
    }
    frames.clear();
    let html = page.html();
    write_whole(&folder.part().join(PAGE), html.as_bytes())?;
    // The page comes last: what it names is there.
    names.push(PAGE.to_owned());
    anyhow::ensure!(!frames.is_stopped(), "stopped");
    enter(Phase::Writing);
    let older = folder.pictures()?;
    folder.finish(&names)?;
    folder.clear(older.iter().filter(|name| !names.contains(name)))?;
    Ok(bytes + html.len() as u64)
}

/// The folder that the export goes into.
struct Folder {
    path: PathBuf,
    /// Whether it was not there before.
    new: bool,
}

impl Folder {
    /// # Errors
    /// For a file, a folder that cannot be made, and one that holds anything but an export.
    fn new(path: &Path) -> Result<Self> {
        let folder = Self { path: path.to_path_buf(), new: is_new_folder(path, "--export")? };
        if !folder.new && !folder.is_empty()? && !folder.holds_an_export()? {
            bail!(Usage(format!("{}: is there already and holds no export; choose another name", path.display())));
        }
        Ok(folder)
    }

    fn is_empty(&self) -> Result<bool> {
        Ok(fs::read_dir(&self.path).with_context(|| self.path.display().to_string())?.next().is_none())
    }

    fn holds_an_export(&self) -> Result<bool> {
        let page = self.path.join(PAGE);
        let mut start = Vec::new();
        match fs::File::open(&page) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(false),
            file => file.and_then(|f| f.take(START.len() as u64).read_to_end(&mut start)).with_context(|| page.display().to_string())?,
        };
        Ok(start == START)
    }

    fn part(&self) -> PathBuf {
        self.path.join(PART)
    }

    /// Makes the folder, and the place in it where files wait.
    ///
    /// # Errors
    /// When that fails, and where another export is under way.
    fn begin(&self) -> Result<()> {
        if self.new {
            fs::create_dir(&self.path).with_context(|| self.path.display().to_string())?;
        }
        let part = self.part();
        match fs::create_dir(&part) {
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {
                bail!("{}: is there already: another export is under way, or was broken off; remove it if it was", part.display())
            }
            made => made.with_context(|| part.display().to_string()),
        }
    }

    /// Puts all files in their place.
    ///
    /// # Errors
    /// When a file cannot be moved there.
    fn finish(&self, names: &[String]) -> Result<()> {
        for name in names {
            let to = self.path.join(name);
            fs::rename(self.part().join(name), &to).with_context(|| to.display().to_string())?;
        }
        fs::remove_dir(self.part()).with_context(|| self.part().display().to_string())
    }

    /// The pictures that the page of an older export names.
    fn pictures(&self) -> Result<Vec<String>> {
        let page = self.path.join(PAGE);
        match fs::read(&page) {
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(Vec::new()),
            html => Ok(pictures_of(&String::from_utf8_lossy(&html.with_context(|| page.display().to_string())?))),
        }
    }

    /// Removes pictures of an older export that no page names any more.
    fn clear<'n>(&self, names: impl Iterator<Item = &'n String>) -> Result<()> {
        for name in names {
            let path = self.path.join(name);
            match fs::remove_file(&path) {
                Err(e) if e.kind() == ErrorKind::NotFound => {}
                removed => removed.with_context(|| path.display().to_string())?,
            }
        }
        Ok(())
    }

    /// Takes away what is there of an export that failed.
    fn take_back(&self) {
        // The failure that led here is the one to report.
        drop(fs::remove_dir_all(self.part()));
        if self.new {
            drop(fs::remove_dir(&self.path));
        }
    }
}
