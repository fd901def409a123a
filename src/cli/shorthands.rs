//! Short flags for the keys of a scene that are set most.

use super::Usage;
use super::flags::SceneFlags;
use anyhow::{Result, bail};
use slicestack::scene::Overrides;

/// Short flags, each for a key.
#[derive(Debug, clap::Args)]
pub(super) struct Shorthands {
    /// Ready-made transfer function: see `slicestack presets`.
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    /// Size of the picture in pixels, such as 800x600.
    #[arg(long, value_name = "WxH", allow_hyphen_values = true)]
    size: Option<String>,
    /// Number of slices.
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    count: Option<String>,
    /// Degrees around the box.
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true)]
    azimuth: Option<String>,
    /// Degrees upwards.
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true)]
    elevation: Option<String>,
    /// 1 fits the volume into the picture, 2 shows it twice as large.
    #[arg(long, value_name = "FACTOR", allow_hyphen_values = true)]
    zoom: Option<String>,
    /// Colour behind the volume: black, white, #rrggbb, or r,g,b,a from 0 to 1; transparent unless given.
    #[arg(long, value_name = "COLOUR")]
    background: Option<String>,
}

impl Shorthands {
    /// Sets the keys they stand for; the long flag wins where both are given.
    ///
    /// # Errors
    /// [`Usage`] for a size or colour that is none.
    pub(super) fn apply(&self, flags: &SceneFlags, overrides: &mut Overrides) -> Result<()> {
        let direct = [
            ("transfer.preset", &self.preset),
            ("slices.count", &self.count),
            ("camera.azimuth", &self.azimuth),
            ("camera.elevation", &self.elevation),
            ("camera.zoom", &self.zoom),
        ];
        for (path, value) in direct {
            if let Some(value) = value.as_ref().filter(|_| !flags.has(path)) {
                overrides.set(path, value);
            }
        }
        if let Some(size) = &self.size {
            let Some((width, height)) = size.split_once(['x', 'X']).filter(|(w, h)| w.parse::<u32>().is_ok() && h.parse::<u32>().is_ok())
            else {
                bail!(Usage(format!("--size {size}: write WIDTHxHEIGHT, such as 800x600")));
            };
            overrides.set("image.width", width);
            overrides.set("image.height", height);
        }
        if let Some(text) = &self.background {
            overrides.set("image.background", background(text)?);
        }
        Ok(())
    }
}

/// A colour as the list that a scene file has.
fn background(text: &str) -> Result<String> {
    let refused = || Usage(format!("--background {text}: write black, white, #rrggbb, or r,g,b,a from 0 to 1"));
    match text {
        "black" => return Ok("0,0,0,1".into()),
        "white" => return Ok("1,1,1,1".into()),
        _ => {}
    }
    if let Some(hex) = text.strip_prefix('#') {
        let number = u32::from_str_radix(hex, 16).ok().filter(|_| hex.len() == 6).ok_or_else(refused)?;
        let [_, r, g, b] = number.to_be_bytes().map(|c| f64::from(c) / 255.0);
        return Ok(format!("{r},{g},{b},1"));
    }
    let numbers: Vec<f64> = text.split(',').map(|n| n.trim().parse().map_err(|_| refused())).collect::<Result<_, _>>()?;
    match numbers.as_slice() {
        [r, g, b] => Ok(format!("{r},{g},{b},1")),
        [r, g, b, a] => Ok(format!("{r},{g},{b},{a}")),
        _ => bail!(refused()),
    }
}
