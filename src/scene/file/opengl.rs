//! The section `[opengl]`: its keys, and the pipeline's state from them.

use super::build::Builder;
use super::keys::{FilterKey, ProfileKey, choices};
use crate::Result;
use crate::scene::{
    AlphaTest, Arithmetic, BlendFunction, Compare, Environment, Equation, Factor, Filter, FogEvaluation, OpenGl, Scissor, TextureFormat,
    Wrap,
};
use glam::{DMat4, DVec4};
use schemars::JsonSchema;
use serde::Deserialize;

#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct OpenGlKeys {
    /// Numbers of the texture: unorm8 (R8, or RGBA8 when pre-classified; the default) or f32.
    pub texture: Option<FormatKey>,
    /// Filter where texels are smaller than pixels; that of render.filter unless given.
    pub min_filter: Option<FilterKey>,
    /// Numbers that 8-bit textures and tables are filtered in: float (the default) or fixed (weights in steps of 1/256, results rounded
    /// to 8 bits, as drivers for the CPU do).
    pub filter_arithmetic: Option<ArithmeticKey>,
    /// What lies beyond the texture along all axes: clamp-to-edge (the default), clamp-to-border or repeat.
    pub wrap: Option<WrapKey>,
    /// The same along s (voxel axis x) alone.
    pub wrap_s: Option<WrapKey>,
    /// The same along t (voxel axis y) alone.
    pub wrap_t: Option<WrapKey>,
    /// The same along p (voxel axis z; OpenGL's r) alone.
    pub wrap_p: Option<WrapKey>,
    /// Red, green, blue, alpha of the border, each 0 to 1; of a texture of values the red is the value. Black and transparent unless given.
    /// For the wrap mode clamp-to-border.
    pub border_color: Option<[f64; 4]>,
    /// Four rows of four numbers, [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]], as a flag sixteen numbers row by row; applied to (s,t,p,1); lookups are at (s/q, t/q, p/q). The
    /// identity unless given.
    pub texture_matrix: Option<[[f64; 4]; 4]>,
    /// Numbers of the table of 256 colours; unorm8 for fixed-point targets and f32 for a float one unless given.
    pub table: Option<FormatKey>,
    /// Filter of the table; linear unless given.
    pub table_filter: Option<FilterKey>,
    /// Colours of the table: premultiplied by opacity (the default) or straight.
    pub table_colors: Option<ColorsKey>,
    /// What becomes of the texture's colour: replace (the default) or modulate, by primary_color.
    pub environment: Option<EnvironmentKey>,
    /// Red, green, blue, alpha of the slices, each 0 to 1; white unless given.
    pub primary_color: Option<[f64; 4]>,
    /// Where radial fog is computed: at each fragment (the default) or at the corners of slices (vertex).
    pub fog_evaluation: Option<FogEvaluationKey>,
    /// Which fragments pass, by their alpha against alpha_reference; all unless given.
    pub alpha_test: Option<CompareKey>,
    /// What alpha is compared with, 0 to 1; 0 unless given.
    pub alpha_reference: Option<f64>,
    /// Numbers that fragments are blended in: fixed (levels of the framebuffer, the default) or float (rounded once, at the end).
    pub blend_arithmetic: Option<ArithmeticKey>,
    /// How products of colours and factors combine; add unless given.
    pub blend_equation: Option<EquationKey>,
    /// Factor of the fragment's colour; one unless given, with a straight table src-alpha.
    pub blend_source: Option<FactorKey>,
    /// Factor of the framebuffer's colour; one-minus-src-alpha unless given.
    pub blend_destination: Option<FactorKey>,
    /// The equation for alpha; that of colours unless given.
    pub blend_equation_alpha: Option<EquationKey>,
    /// The fragment's factor for alpha; that of colours unless given. A straight table without blend_source and blend_destination has
    /// one, so that alpha is not multiplied by itself.
    pub blend_source_alpha: Option<FactorKey>,
    /// The framebuffer's factor for alpha; that of colours unless given.
    pub blend_destination_alpha: Option<FactorKey>,
    /// Red, green, blue, alpha of the constant factors (constant-color and its like), each 0 to 1; 0 unless given.
    pub blend_color: Option<[f64; 4]>,
    /// Columns to the left, rows below, columns and rows of the rectangle that is drawn; all unless given.
    pub scissor: Option<[u32; 4]>,
}

choices! {
    FormatKey { Unorm8, F32 }
    WrapKey { ClampToEdge, ClampToBorder, Repeat }
    ColorsKey { Premultiplied, Straight }
    EnvironmentKey { Replace, Modulate }
    FogEvaluationKey { Fragment, Vertex }
    CompareKey { Never, Less, Equal, Lequal, Greater, Notequal, Gequal, Always }
    ArithmeticKey { Fixed, Float }
    EquationKey { Add, Subtract, ReverseSubtract, Min, Max }
    FactorKey {
        Zero, One, SrcColor, OneMinusSrcColor, DstColor, OneMinusDstColor, SrcAlpha, OneMinusSrcAlpha, DstAlpha, OneMinusDstAlpha,
        ConstantColor, OneMinusConstantColor, ConstantAlpha, OneMinusConstantAlpha, SrcAlphaSaturate
    }
}

impl From<FormatKey> for TextureFormat {
    fn from(key: FormatKey) -> Self {
        match key {
            FormatKey::Unorm8 => Self::Unorm8,
            FormatKey::F32 => Self::F32,
        }
    }
}

impl From<FilterKey> for Filter {
    fn from(key: FilterKey) -> Self {
        match key {
            FilterKey::Linear => Self::Linear,
            FilterKey::Nearest => Self::Nearest,
        }
    }
}

impl From<WrapKey> for Wrap {
    fn from(key: WrapKey) -> Self {
        match key {
            WrapKey::ClampToEdge => Self::ClampToEdge,
            WrapKey::ClampToBorder => Self::ClampToBorder,
            WrapKey::Repeat => Self::Repeat,
        }
    }
}

impl From<CompareKey> for Compare {
    fn from(key: CompareKey) -> Self {
        Self::ALL[key as usize]
    }
}

impl From<EquationKey> for Equation {
    fn from(key: EquationKey) -> Self {
        Self::ALL[key as usize]
    }
}

impl From<FactorKey> for Factor {
    fn from(key: FactorKey) -> Self {
        Self::ALL[key as usize]
    }
}

impl Builder<'_> {
    /// The pipeline's state, where the scene asks for the profile.
    pub(super) fn opengl(&self) -> Result<Option<OpenGl>> {
        let (d, k) = (self.document, &self.document.opengl);
        if d.render.profile != Some(ProfileKey::Opengl) {
            return match self.places.first_in("opengl") {
                Some(key) => Err(self.error(key, "is for render.profile = \"opengl\" alone")),
                None => Ok(None),
            };
        }
        let s = &d.slices;
        let accurate = [
            ("slices.tolerance", s.tolerance.is_some()),
            ("slices.terminate", s.terminate.is_some()),
            ("slices.slab", s.slab.is_some()),
            ("slices.sample", s.sample.is_some()),
            ("slices.ends", s.ends == Some(super::keys::EndsKey::Partial)),
            ("slices.accumulation", s.accumulation.is_some()),
            ("slices.extrapolate", s.extrapolate.is_some()),
            ("slices.merge", s.merge.is_some()),
        ];
        self.refuse(&accurate, "belongs to the profile accurate; opengl draws every slice as a whole slab")?;
        if d.fog.mode.is_none() {
            self.refuse(&[("opengl.fog_evaluation", k.fog_evaluation.is_some())], "has no effect without fog.mode")?;
        }
        if k.environment != Some(EnvironmentKey::Modulate) {
            let why = "is for opengl.environment = \"modulate\"";
            self.refuse(&[("opengl.primary_color", k.primary_color.is_some())], why)?;
        }
        let straight = k.table_colors == Some(ColorsKey::Straight);
        let usual = if straight { OpenGl::straight_separate() } else { OpenGl::default() };
        let blend = BlendFunction {
            equation: k.blend_equation.map_or(usual.blend.equation, Equation::from),
            source: k.blend_source.map_or(usual.blend.source, Factor::from),
            destination: k.blend_destination.map_or(usual.blend.destination, Factor::from),
        };
        // Factors for colours are those of alpha too, as glBlendFunc has it; the usual ones know what each is for.
        let given = k.blend_source.is_some() || k.blend_destination.is_some();
        let alpha = BlendFunction {
            equation: k.blend_equation_alpha.map_or(blend.equation, Equation::from),
            source: k.blend_source_alpha.map_or(if given { blend.source } else { usual.blend_alpha.source }, Factor::from),
            destination: k.blend_destination_alpha.map_or(blend.destination, Factor::from),
        };
        let constant = [blend.source, blend.destination, alpha.source, alpha.destination].iter().any(|f| f.is_constant());
        self.refuse(
            &[("opengl.blend_color", k.blend_color.is_some() && !constant)],
            "has no effect without a constant factor, such as opengl.blend_source = \"constant-color\"",
        )?;
        let wrap = k.wrap.unwrap_or(WrapKey::ClampToEdge);
        let wrap = [k.wrap_s, k.wrap_t, k.wrap_p].map(|own| own.unwrap_or(wrap));
        self.refuse(
            &[("opengl.border_color", k.border_color.is_some() && !wrap.contains(&WrapKey::ClampToBorder))],
            "has no effect without opengl.wrap = \"clamp-to-border\"",
        )?;
        let [r0, r1, r2, r3] = k.texture_matrix.map_or(DMat4::IDENTITY.transpose().to_cols_array_2d(), |rows| rows).map(DVec4::from_array);
        Ok(Some(OpenGl {
            texture: k.texture.map_or(usual.texture, TextureFormat::from),
            min_filter: k.min_filter.map(Filter::from),
            filter_arithmetic: if k.filter_arithmetic == Some(ArithmeticKey::Fixed) { Arithmetic::Fixed } else { Arithmetic::Float },
            wrap: wrap.map(Wrap::from),
            border: k.border_color.unwrap_or(usual.border),
            texture_matrix: DMat4::from_cols(r0, r1, r2, r3).transpose(),
            table: k.table.map(TextureFormat::from),
            table_filter: k.table_filter.map_or(usual.table_filter, Filter::from),
            table_colors: usual.table_colors,
            environment: if k.environment == Some(EnvironmentKey::Modulate) { Environment::Modulate } else { Environment::Replace },
            primary: k.primary_color.unwrap_or(usual.primary),
            fog_evaluation: if k.fog_evaluation == Some(FogEvaluationKey::Vertex) {
                FogEvaluation::Vertex
            } else {
                FogEvaluation::Fragment
            },
            alpha_test: self.alpha_test()?,
            blend_arithmetic: if k.blend_arithmetic == Some(ArithmeticKey::Float) { Arithmetic::Float } else { Arithmetic::Fixed },
            blend,
            blend_alpha: alpha,
            blend_constant: k.blend_color.unwrap_or(usual.blend_constant),
            scissor: k.scissor.map(|[x, y, width, height]| Scissor { x, y, width, height }),
        }))
    }

    fn alpha_test(&self) -> Result<Option<AlphaTest>> {
        let k = &self.document.opengl;
        let Some(compare) = k.alpha_test else {
            self.refuse(&[("opengl.alpha_reference", k.alpha_reference.is_some())], "has no effect without opengl.alpha_test")?;
            return Ok(None);
        };
        Ok(Some(AlphaTest { compare: compare.into(), reference: k.alpha_reference.unwrap_or(0.0) }))
    }
}
