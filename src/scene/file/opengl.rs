//! The section `[opengl]`: its keys, and the pipeline's state from them.

use super::section::{Context, choices};
use crate::Result;
use crate::scene::{
    AlphaTest, Arithmetic, BlendFunction, Compare, Environment, Equation, Factor, Filter, FogEvaluation, OpenGl, Scene, Scissor,
    TableColors, TextureFormat, Wrap,
};
use glam::{DMat4, DVec4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct OpenGlKeys {
    /// Numbers of the texture: unorm8 (R8, or RGBA8 when pre-classified; the default) or f32.
    pub texture: Option<FormatKey>,
    /// Filter where texels are smaller than pixels; that of render.filter unless given.
    pub min_filter: Option<TexelFilterKey>,
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
    pub table_filter: Option<TexelFilterKey>,
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
    FormatKey => TextureFormat { Unorm8, F32 }
    TexelFilterKey =>? Filter { Linear, Nearest }
    WrapKey => Wrap { ClampToEdge, ClampToBorder, Repeat }
    ColorsKey => TableColors { Premultiplied, Straight }
    EnvironmentKey => Environment { Replace, Modulate }
    FogEvaluationKey => FogEvaluation { Fragment, Vertex }
    CompareKey => Compare {
        Never, Less, Equal, Lequal as LessOrEqual, Greater, Notequal as NotEqual, Gequal as GreaterOrEqual, Always
    }
    ArithmeticKey => Arithmetic { Fixed, Float }
    EquationKey => Equation { Add, Subtract, ReverseSubtract, Min, Max }
    FactorKey => Factor {
        Zero, One, SrcColor, OneMinusSrcColor, DstColor, OneMinusDstColor, SrcAlpha, OneMinusSrcAlpha, DstAlpha, OneMinusDstAlpha,
        ConstantColor, OneMinusConstantColor, ConstantAlpha, OneMinusConstantAlpha, SrcAlphaSaturate
    }
}

impl OpenGlKeys {
    /// The keys that say what state draws `scene`; none where OpenGL does not draw it. What has no effect there is left out.
    pub(super) fn of(scene: &Scene) -> Self {
        let Some(gl) = scene.opengl() else { return Self::default() };
        let [wrap_s, wrap_t, wrap_p] = gl.wrap;
        let alike = wrap_s == wrap_t && wrap_t == wrap_p;
        let own = |wrap: Wrap| (!alike).then_some(wrap.into());
        let constant = [gl.blend.source, gl.blend.destination, gl.blend_alpha.source, gl.blend_alpha.destination];
        Self {
            texture: Some(gl.texture.into()),
            min_filter: gl.min_filter.and_then(TexelFilterKey::of),
            filter_arithmetic: Some(gl.filter_arithmetic.into()),
            wrap: alike.then_some(wrap_s.into()),
            wrap_s: own(wrap_s),
            wrap_t: own(wrap_t),
            wrap_p: own(wrap_p),
            border_color: gl.wrap.contains(&Wrap::ClampToBorder).then_some(gl.border),
            texture_matrix: Some(gl.texture_matrix.transpose().to_cols_array_2d()),
            table: gl.table.map(FormatKey::from),
            table_filter: TexelFilterKey::of(gl.table_filter),
            table_colors: Some(gl.table_colors.into()),
            environment: Some(gl.environment.into()),
            primary_color: (gl.environment == Environment::Modulate).then_some(gl.primary),
            fog_evaluation: scene.fog().map(|_| gl.fog_evaluation.into()),
            alpha_test: gl.alpha_test.map(|test| test.compare.into()),
            alpha_reference: gl.alpha_test.map(|test| test.reference),
            blend_arithmetic: Some(gl.blend_arithmetic.into()),
            blend_equation: Some(gl.blend.equation.into()),
            blend_source: Some(gl.blend.source.into()),
            blend_destination: Some(gl.blend.destination.into()),
            blend_equation_alpha: Some(gl.blend_alpha.equation.into()),
            blend_source_alpha: Some(gl.blend_alpha.source.into()),
            blend_destination_alpha: Some(gl.blend_alpha.destination.into()),
            blend_color: constant.iter().any(|f| f.is_constant()).then_some(gl.blend_constant),
            scissor: gl.scissor.map(|s| [s.x, s.y, s.width, s.height]),
        }
    }

    /// `scene` drawn as OpenGL draws, where the section `[render]` asks for that profile.
    pub(super) fn apply(&self, cx: &Context<'_>, scene: Scene) -> Result<Scene> {
        if !cx.document.render.is_opengl() {
            return match cx.places.first_in("opengl") {
                Some(key) => Err(cx.error(key, "is for render.profile = \"opengl\" alone")),
                None => Ok(scene),
            };
        }
        if cx.document.fog.mode.is_none() {
            cx.refuse(&[("opengl.fog_evaluation", self.fog_evaluation.is_some())], "has no effect without fog.mode")?;
        }
        if self.environment != Some(EnvironmentKey::Modulate) {
            let why = "is for opengl.environment = \"modulate\"";
            cx.refuse(&[("opengl.primary_color", self.primary_color.is_some())], why)?;
        }
        let straight = self.table_colors == Some(ColorsKey::Straight);
        let usual = if straight { OpenGl::straight_separate() } else { OpenGl::default() };
        let (blend, blend_alpha) = self.blend(cx, &usual)?;
        let identity = DMat4::IDENTITY.to_cols_array_2d();
        let [r0, r1, r2, r3] = self.texture_matrix.unwrap_or(identity).map(DVec4::from_array);
        scene.with_opengl(OpenGl {
            texture: self.texture.map_or(usual.texture, TextureFormat::from),
            min_filter: self.min_filter.map(Filter::from),
            filter_arithmetic: self.filter_arithmetic.map_or(usual.filter_arithmetic, Arithmetic::from),
            wrap: self.wrap(cx)?,
            border: self.border_color.unwrap_or(usual.border),
            texture_matrix: DMat4::from_cols(r0, r1, r2, r3).transpose(),
            table: self.table.map(TextureFormat::from),
            table_filter: self.table_filter.map_or(usual.table_filter, Filter::from),
            table_colors: self.table_colors.map_or(usual.table_colors, TableColors::from),
            environment: self.environment.map_or(usual.environment, Environment::from),
            primary: self.primary_color.unwrap_or(usual.primary),
            fog_evaluation: self.fog_evaluation.map_or(usual.fog_evaluation, FogEvaluation::from),
            alpha_test: self.alpha_test(cx)?,
            blend_arithmetic: self.blend_arithmetic.map_or(usual.blend_arithmetic, Arithmetic::from),
            blend,
            blend_alpha,
            blend_constant: self.blend_color.unwrap_or(usual.blend_constant),
            scissor: self.scissor.map(|[x, y, width, height]| Scissor { x, y, width, height }),
        })
    }

    /// The functions of colours and of alpha.
    fn blend(&self, cx: &Context<'_>, usual: &OpenGl) -> Result<(BlendFunction, BlendFunction)> {
        let blend = BlendFunction {
            equation: self.blend_equation.map_or(usual.blend.equation, Equation::from),
            source: self.blend_source.map_or(usual.blend.source, Factor::from),
            destination: self.blend_destination.map_or(usual.blend.destination, Factor::from),
        };
        // Factors that are given for colours hold for alpha too, as glBlendFunc has it; the usual ones are for colours or alpha alone.
        let given = self.blend_source.is_some() || self.blend_destination.is_some();
        let alpha = BlendFunction {
            equation: self.blend_equation_alpha.map_or(blend.equation, Equation::from),
            source: self.blend_source_alpha.map_or(if given { blend.source } else { usual.blend_alpha.source }, Factor::from),
            destination: self.blend_destination_alpha.map_or(blend.destination, Factor::from),
        };
        let constant = [blend.source, blend.destination, alpha.source, alpha.destination].iter().any(|f| f.is_constant());
        cx.refuse(
            &[("opengl.blend_color", self.blend_color.is_some() && !constant)],
            "has no effect without a constant factor, such as opengl.blend_source = \"constant-color\"",
        )?;
        Ok((blend, alpha))
    }

    /// What lies beyond the texture along s, t and p.
    fn wrap(&self, cx: &Context<'_>) -> Result<[Wrap; 3]> {
        let all = self.wrap.unwrap_or(WrapKey::ClampToEdge);
        let wrap = [self.wrap_s, self.wrap_t, self.wrap_p].map(|own| own.unwrap_or(all));
        cx.refuse(
            &[("opengl.border_color", self.border_color.is_some() && !wrap.contains(&WrapKey::ClampToBorder))],
            "has no effect without opengl.wrap = \"clamp-to-border\"",
        )?;
        Ok(wrap.map(Wrap::from))
    }

    fn alpha_test(&self, cx: &Context<'_>) -> Result<Option<AlphaTest>> {
        let Some(compare) = self.alpha_test else {
            cx.refuse(&[("opengl.alpha_reference", self.alpha_reference.is_some())], "has no effect without opengl.alpha_test")?;
            return Ok(None);
        };
        Ok(Some(AlphaTest { compare: compare.into(), reference: self.alpha_reference.unwrap_or(0.0) }))
    }
}
