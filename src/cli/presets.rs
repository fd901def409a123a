//! `slicestack presets`.

use super::output::print;
use anyhow::Result;
use slicestack::scene::{ColorMap, Preset, TransferFunction};
use std::io::{IsTerminal, stdout};

/// Terminal cells of a colour strip.
const CELLS: usize = 48;

pub(super) fn run() -> Result<()> {
    let colored = stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let mut text = String::from("Presets (--preset NAME; slicestack info FILE tells which suit a file):\n");
    for preset in Preset::ALL {
        text += &format!("  {:18}  {}\n", preset.name(), preset.about());
    }
    text += "\nColour maps (--transfer.colormap NAME):\n";
    for map in ColorMap::ALL {
        let strip = if colored { strip(map)? } else { String::new() };
        text += format!("  {:18}  {strip}", map.name()).trim_end();
        text += "\n";
    }
    print(text.as_bytes())
}

/// The map in coloured cells.
fn strip(map: ColorMap) -> Result<String> {
    let colors = TransferFunction::new(map.spread(0.0, 1.0), vec![(0.0, 1.0)])?;
    let mut text = String::new();
    for cell in 0..CELLS {
        let [r, g, b] = colors.eval(cell as f64 / (CELLS - 1) as f64).rgb.map(|c| (c * 255.0 + 0.5) as u8);
        text += &format!("\x1b[48;2;{r};{g};{b}m ");
    }
    Ok(text + "\x1b[0m")
}
