//! What the parts of a scene say to each other: which go together, and why others do not.

use super::*;

impl Scene {
    /// The scene itself, unless it asks for what its profile does not have.
    pub(super) fn agreed(self) -> Result<Self> {
        for option in OptionalStage::wanted(&self).map(OptionalStage::option) {
            let checks = [
                (self.opengl.is_some(), option.opengl, "the profile opengl"),
                (self.method.is_pre_integrated(), option.pairs, "pre-integrated classification"),
                (self.method.merge, option.merging, "slices merge"),
                (self.method.slab == SlabForm::Riemann, option.riemann, "slices slab riemann"),
                (self.blend.projects_values(), option.projections.refusal(), "a projection of values"),
            ];
            for (asked, fits, with) in checks {
                if let (true, Fits::No(why)) = (asked, fits) {
                    return Err(Error::invalid(format!("{}: does not go together with {with}: {why}", option.key)));
                }
            }
        }
        self.check_segments()?;
        self.check_regions()?;
        if self.opengl.is_some() && self.algorithm != Algorithm::Slices {
            return Err(Error::invalid(format!("render algorithm {}: the profile opengl draws slices", self.algorithm.name())));
        }
        if self.opengl.is_some() && self.jitter.is_some() {
            return Err(Error::invalid("slices jitter: the profile opengl draws flat slices"));
        }
        self.algorithm.check_with(&self)?;
        self.rays_agree()?;
        match (self.window, self.blend) {
            (Some([center, width]), Blend::Add) if center < 0.5 * width => {
                let first = center - 0.5 * width;
                return Err(Error::invalid(format!("render window [{center}, {width}]: begins at {first}; sums of colours begin at 0")));
            }
            (None, _) | (Some(_), Blend::Add | Blend::AttenuatedMip { .. }) => {}
            (Some(_), _) => return Err(Error::invalid("render window: is for the blends add and attenuated-mip")),
        }
        let m = &self.method;
        if self.blend == Blend::Under && self.order == Order::BackToFront && m.is_pre_integrated() {
            return Err(Error::invalid(
                "render blend under: slabs between two slices (transfer.classification pre-integrated and second-order) are blended front to back, where under is over; choose post, or another order",
            ));
        }
        if m.filter.is_cubic() && matches!(self.blend, Blend::Iso { .. } | Blend::Surfaces) {
            return Err(Error::invalid("render filter cubic: level surfaces (render blend iso) are those of linear interpolation"));
        }
        let plain = Method { classification: m.classification, filter: m.filter, target: m.target, ends: m.ends, ..Method::default() };
        if self.opengl.is_none() {
            if m.target == Target::Unorm16 {
                return Err(Error::invalid("render target unorm16: is for the profile opengl"));
            }
        } else if self.linear_light() {
            return Err(Error::invalid("render linear_light: the profile opengl blends the display's numbers"));
        } else if m.filter.is_cubic() {
            return Err(Error::invalid("render filter cubic: the profile opengl has linear and nearest"));
        } else if m.is_pre_integrated() {
            return Err(Error::invalid("transfer classification: the profile opengl has post and pre"));
        } else if *m != plain {
            return Err(Error::invalid("slices: slab, sample, accumulation, extrapolate and merge are not for the profile opengl"));
        } else if matches!(self.slicing, Slicing::Tolerance(_)) {
            return Err(Error::invalid("slices tolerance: the profile opengl draws a given number of slices"));
        } else if self.blend != Blend::Over {
            return Err(Error::invalid("render blend: the profile opengl blends by the functions of the section opengl"));
        }
        Ok(self)
    }

    /// Whether what depends on single rays goes together with the rest.
    fn rays_agree(&self) -> Result<()> {
        let (m, surfaces) = (&self.method, matches!(self.blend, Blend::Iso { .. } | Blend::Surfaces));
        let shells = self.algorithm == Algorithm::Shells;
        if self.jitter.is_some() && !matches!(self.algorithm, Algorithm::Slices | Algorithm::Shells) {
            let name = self.algorithm.name();
            return Err(Error::invalid(format!(
                "slices jitter: does not go together with render algorithm {name}: it has no slices to shift"
            )));
        }
        if self.jitter.is_some() && m.extrapolate {
            return Err(Error::invalid("slices extrapolate: noise of jitter (slices.jitter) is no series to extrapolate"));
        }
        if shells || self.jitter.is_some() {
            let what = if shells { "render algorithm shells" } else { "slices jitter" };
            if m.is_pre_integrated() {
                return Err(Error::invalid(format!(
                    "{what}: slabs between two slices (transfer.classification pre-integrated and second-order) end at flat slices, whose values they keep; choose post"
                )));
            }
            if m.merge {
                return Err(Error::invalid(format!("{what}: slabs merge (slices.merge) between flat slices alone")));
            }
            if surfaces {
                return Err(Error::invalid(format!(
                    "{what}: level surfaces are met between two flat slices; choose slices without jitter"
                )));
            }
        }
        if (self.algorithm != Algorithm::Slices || self.jitter.is_some()) && (self.uses_labels() || !self.regions.is_empty()) {
            return Err(Error::invalid(
                "labels and regions: are found along flat slices; choose render.algorithm slices without slices.jitter",
            ));
        }
        if self.cuts.is_empty() {
            return Ok(());
        }
        let no = |why: &str| Err(Error::invalid(format!("cut: planes inside the picture {why}")));
        if self.opengl.is_some() {
            return no("are not drawn by the profile opengl; choose accurate");
        }
        if !matches!(self.algorithm, Algorithm::Slices | Algorithm::Shells) {
            return no(&format!("are for the algorithms slices and shells, not for {}", self.algorithm.name()));
        }
        if self.blend != Blend::Over {
            return no("hide what is behind them: they are for render.blend \"over\" alone");
        }
        if m.is_pre_integrated() {
            return no(
                "end a ray between two slices, where slabs of transfer.classification pre-integrated and second-order have no value; choose post",
            );
        }
        if m.merge {
            return no("end a ray anywhere: slabs do not merge (slices.merge) beside them");
        }
        Ok(())
    }
}
