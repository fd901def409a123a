//! The section `[transfer]` of a scene whose voxels are colours: what their opacity goes by.

use super::section::{Context, Data, Given};
use super::transfer::TransferKeys;
use crate::Result;
use crate::scene::{OpacityFrom, TransferFunction};

/// Opacity over luma or maximum where a scene gives no points: black is nothing, as around most pictures of an object.
const RAMP: [(f64, f64); 2] = [(0.1, 0.0), (1.0, 0.25)];

impl TransferKeys {
    /// Refuses keys of transfer functions, which go by a value.
    pub(super) fn refuse_values(&self, cx: &Context<'_>) -> Result<()> {
        let of_colors = |key: &str| matches!(key, "transfer.opacity" | "transfer.opacity_unit");
        let keys: Vec<Given> = self.given().into_iter().filter(|(key, _)| !of_colors(key)).collect();
        let keys = [keys, vec![("transfer.classification", self.classification.is_some())]].concat();
        cx.refuse(&keys, "is for voxels of one number; voxels that are colours take transfer.opacity_from, opacity and opacity_unit")
    }

    /// The scene with opacities for the colours of its volume, which go by what is `usual` for them where nothing else is given.
    pub(super) fn finish_colors(&self, cx: &Context<'_>, data: &mut Data<'_>, usual: OpacityFrom) -> Result<()> {
        self.refuse_values(cx)?;
        let from = self.opacity_from.map_or(usual, OpacityFrom::from);
        let opacity = match (from, &self.opacity) {
            (OpacityFrom::Alpha, None) => vec![(0.0, 0.0), (1.0, 1.0)],
            (OpacityFrom::Alpha, Some(_)) => {
                return Err(cx.error("transfer.opacity", "the colours have an alpha; transfer.opacity_from luma or maximum takes points"));
            }
            (_, Some(points)) => {
                if let Some([last, _]) = points.last().filter(|[last, _]| *last > 1.5) {
                    data.warnings.push(format!("transfer.opacity: its points go up to {last}, and {} lies between 0 and 1", from.name()));
                }
                points.iter().map(|&[v, a]| (v, a)).collect()
            }
            (_, None) => {
                let [(dark, none), (light, most)] = RAMP;
                data.notes.push(format!(
                    "opacity goes by {}: from {none} at {dark} to {most} at {light} (transfer.opacity: other points; transfer.opacity_from: another number)",
                    from.name()
                ));
                RAMP.to_vec()
            }
        };
        let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], opacity).and_then(|t| self.with_rest(t));
        let transfer = transfer.map_err(|e| cx.places.locate(e))?;
        data.scene = data.scene.clone().with_transfer(transfer).with_opacity_from(Some(from));
        Ok(())
    }
}
