//! `slicestack schema`.

use super::output::print;
use anyhow::Result;

pub(super) fn run() -> Result<()> {
    let text = serde_json::to_string_pretty(&slicestack::scene::schema())?;
    print(format!("{text}\n").as_bytes())
}
