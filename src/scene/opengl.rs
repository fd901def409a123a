//! The state of an OpenGL 1.x pipeline: what a program sets with `glTexParameter`, `glTexEnv`, `glBlendFunc` and their like.
//!
//! Names and meanings are those of the OpenGL specification (versions 1.2 to 1.5; sections 3.8 texturing, 3.10 fog, 4.1
//! per-fragment operations). What the rest of the scene says already stands there: clip planes, fog, the order of slices, and in
//! [`Method`](super::Method) the texture's filter, when values are classified, and the framebuffer's numbers.

use super::Filter;
use crate::{Error, Result};
use glam::{DMat4, DVec4};

/// Numbers that a texture's texels are kept in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TextureFormat {
    /// 8 bits a component, 0 to 1: R8 for values, RGBA8 for colours.
    #[default]
    Unorm8,
    /// 32-bit floats (an extension to OpenGL 1.x): R32F, RGBA32F.
    F32,
}

/// What a lookup finds beyond `[0,1]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wrap {
    /// `GL_CLAMP_TO_EDGE`: the outermost texel.
    #[default]
    ClampToEdge,
    /// `GL_CLAMP_TO_BORDER`: the border colour.
    ClampToBorder,
    /// `GL_REPEAT`: the texture again.
    Repeat,
}

/// What the table's entries hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TableColors {
    /// Colours times opacity.
    #[default]
    Premultiplied,
    /// Colours beside their opacity. Interpolating them bleeds the colour of transparent entries.
    Straight,
}

/// What becomes of a texture's colour: `GL_TEXTURE_ENV_MODE`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Environment {
    /// It is the fragment's colour.
    #[default]
    Replace,
    /// It is multiplied by the primary colour, each component by its own.
    Modulate,
}

/// Where the fog factor is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FogEvaluation {
    /// At each fragment.
    #[default]
    Fragment,
    /// At the corners of a slice and at their mean; linear in the triangles between them.
    Vertex,
}

/// Numbers that 8-bit textures are filtered in, or that fragments are blended in on their way into a fixed-point framebuffer. Floats
/// stay floats. OpenGL leaves both open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arithmetic {
    /// Fixed point. A filter has weights in steps of 1/256, rounded down, and rounds to 8 bits after each of its three directions. A
    /// blend has the framebuffer's own levels: the fragment is rounded to them before alpha test and blending, and so is each product
    /// of a colour and a factor. Mesa's driver for the CPU computes so.
    Fixed,
    /// Floats. What is blended is rounded once, when it is stored.
    Float,
}

/// Comparison of the alpha test: `GL_NEVER` and its like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say it all")]
pub enum Compare {
    Never,
    Less,
    Equal,
    LessOrEqual,
    Greater,
    NotEqual,
    GreaterOrEqual,
    Always,
}

/// A factor of the blend function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are OpenGL's")]
pub enum Factor {
    Zero,
    One,
    SrcColor,
    OneMinusSrcColor,
    DstColor,
    OneMinusDstColor,
    SrcAlpha,
    OneMinusSrcAlpha,
    DstAlpha,
    OneMinusDstAlpha,
    ConstantColor,
    OneMinusConstantColor,
    ConstantAlpha,
    OneMinusConstantAlpha,
    /// min(As, 1 - Ad) for colours, 1 for alpha.
    SrcAlphaSaturate,
}

/// How products of colours and factors combine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Equation {
    /// S s + D d.
    #[default]
    Add,
    /// S s - D d.
    Subtract,
    /// D d - S s.
    ReverseSubtract,
    /// min(S, D): factors do not count.
    Min,
    /// max(S, D): factors do not count.
    Max,
}

impl Compare {
    /// All of them, in OpenGL's order.
    pub const ALL: [Self; 8] =
        [Self::Never, Self::Less, Self::Equal, Self::LessOrEqual, Self::Greater, Self::NotEqual, Self::GreaterOrEqual, Self::Always];

    /// Whether `a` passes against `reference`.
    pub fn passes(self, a: f64, reference: f64) -> bool {
        match self {
            Self::Never => false,
            Self::Less => a < reference,
            Self::Equal => a == reference,
            Self::LessOrEqual => a <= reference,
            Self::Greater => a > reference,
            Self::NotEqual => a != reference,
            Self::GreaterOrEqual => a >= reference,
            Self::Always => true,
        }
    }
}

impl Factor {
    /// All of them.
    pub const ALL: [Self; 15] = [
        Self::Zero,
        Self::One,
        Self::SrcColor,
        Self::OneMinusSrcColor,
        Self::DstColor,
        Self::OneMinusDstColor,
        Self::SrcAlpha,
        Self::OneMinusSrcAlpha,
        Self::DstAlpha,
        Self::OneMinusDstAlpha,
        Self::ConstantColor,
        Self::OneMinusConstantColor,
        Self::ConstantAlpha,
        Self::OneMinusConstantAlpha,
        Self::SrcAlphaSaturate,
    ];

    /// Whether it is of the blend colour.
    pub fn is_constant(self) -> bool {
        matches!(self, Self::ConstantColor | Self::OneMinusConstantColor | Self::ConstantAlpha | Self::OneMinusConstantAlpha)
    }
}

impl Equation {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Add, Self::Subtract, Self::ReverseSubtract, Self::Min, Self::Max];
}

/// Equation and factors for one kind of component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlendFunction {
    /// How the products combine.
    pub equation: Equation,
    /// Factor s of the fragment's colour S.
    pub source: Factor,
    /// Factor d of the framebuffer's colour D.
    pub destination: Factor,
}

impl BlendFunction {
    /// S s + D d.
    pub const fn add(source: Factor, destination: Factor) -> Self {
        Self { equation: Equation::Add, source, destination }
    }

    /// S + (1 - As) D: over, for premultiplied colours.
    pub const OVER: Self = Self::add(Factor::One, Factor::OneMinusSrcAlpha);

    /// As S + (1 - As) D: over, for straight colours. Its alpha is not that of over.
    pub const OVER_STRAIGHT: Self = Self::add(Factor::SrcAlpha, Factor::OneMinusSrcAlpha);
}

/// Discards fragments by their alpha.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlphaTest {
    /// Which ones pass.
    pub compare: Compare,
    /// What they are compared with, in `[0,1]`.
    pub reference: f64,
}

/// A rectangle of pixels; what lies outside is not drawn. From the lower left corner, as `glScissor` has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scissor {
    /// Columns to its left.
    pub x: u32,
    /// Rows below it.
    pub y: u32,
    /// Its columns.
    pub width: u32,
    /// Its rows.
    pub height: u32,
}

/// The state of the pipeline. [`Scene::with_opengl`](super::Scene::with_opengl) checks it.
///
/// The default draws premultiplied colours, over, from an 8-bit texture clamped to its edge, filtered in floats and blended in fixed
/// point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpenGl {
    /// Numbers of the texture.
    pub texture: TextureFormat,
    /// Filter where a texel is smaller than a pixel; `None` = the filter of the method, as where it is larger.
    pub min_filter: Option<Filter>,
    /// Numbers that 8-bit texels and table entries are filtered in.
    pub filter_arithmetic: Arithmetic,
    /// What lies beyond the texture, along s, t and p.
    pub wrap: [Wrap; 3],
    /// Border colour in `[0,1]`; of a texture of values the red component is the value.
    pub border: [f64; 4],
    /// Applied to (s,t,p,1); the lookup is at (s/q, t/q, p/q).
    pub texture_matrix: DMat4,
    /// Numbers of the table; `None` = 8 bits for fixed-point framebuffers, floats for a float one.
    pub table: Option<TextureFormat>,
    /// Filter of the table.
    pub table_filter: Filter,
    /// What its entries hold.
    pub table_colors: TableColors,
    /// What becomes of the texture's colour.
    pub environment: Environment,
    /// Primary colour in `[0,1]`.
    pub primary: [f64; 4],
    /// Where fog is computed.
    pub fog_evaluation: FogEvaluation,
    /// Discards fragments by their alpha.
    pub alpha_test: Option<AlphaTest>,
    /// Numbers that fragments are blended in.
    pub blend_arithmetic: Arithmetic,
    /// How red, green and blue are blended.
    pub blend: BlendFunction,
    /// How alpha is blended.
    pub blend_alpha: BlendFunction,
    /// `GL_BLEND_COLOR`, in `[0,1]`.
    pub blend_constant: [f64; 4],
    /// The part of the picture that is drawn.
    pub scissor: Option<Scissor>,
}

impl Default for OpenGl {
    fn default() -> Self {
        Self {
            texture: TextureFormat::Unorm8,
            min_filter: None,
            filter_arithmetic: Arithmetic::Float,
            wrap: [Wrap::ClampToEdge; 3],
            border: [0.0; 4],
            texture_matrix: DMat4::IDENTITY,
            table: None,
            table_filter: Filter::Linear,
            table_colors: TableColors::Premultiplied,
            environment: Environment::Replace,
            primary: [1.0; 4],
            fog_evaluation: FogEvaluation::Fragment,
            alpha_test: None,
            blend_arithmetic: Arithmetic::Fixed,
            blend: BlendFunction::OVER,
            blend_alpha: BlendFunction::OVER,
            blend_constant: [0.0; 4],
            scissor: None,
        }
    }
}

impl OpenGl {
    /// Straight colours with `glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA)`, which multiplies alpha by itself: what is in the
    /// framebuffer is no premultiplied picture. [`straight_separate`](Self::straight_separate) makes one.
    pub fn straight() -> Self {
        Self {
            table_colors: TableColors::Straight,
            blend: BlendFunction::OVER_STRAIGHT,
            blend_alpha: BlendFunction::OVER_STRAIGHT,
            ..Self::default()
        }
    }

    /// Straight colours with `glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA)`: colours and
    /// alpha both add up as those of over do. Scene files with straight colours get it unless they give factors.
    pub fn straight_separate() -> Self {
        Self { blend_alpha: BlendFunction::OVER, ..Self::straight() }
    }

    /// The same state with one blend function for all components.
    #[must_use]
    pub fn with_blend(mut self, function: BlendFunction) -> Self {
        (self.blend, self.blend_alpha) = (function, function);
        self
    }

    /// # Errors
    /// [`Error::Invalid`] that names the key and the number outside its range.
    pub(super) fn check(&self) -> Result<()> {
        let colors = [("border_color", self.border), ("primary_color", self.primary), ("blend_color", self.blend_constant)];
        for (name, color) in colors {
            if let Some(c) = color.iter().find(|c| !(0.0..=1.0).contains(*c)) {
                return Err(Error::invalid(format!("opengl {name} {c}: outside [0,1]")));
            }
        }
        if self.table_filter.is_cubic() || self.min_filter.is_some_and(Filter::is_cubic) {
            return Err(Error::invalid("opengl table_filter, min_filter cubic: there are linear and nearest"));
        }
        if let Some(test) = self.alpha_test.filter(|t| !(0.0..=1.0).contains(&t.reference)) {
            return Err(Error::invalid(format!("opengl alpha_reference {}: outside [0,1]", test.reference)));
        }
        let rows: [DVec4; 4] = std::array::from_fn(|i| self.texture_matrix.row(i));
        if let Some(x) = rows.iter().flat_map(|r| r.to_array()).find(|x| !(x.abs() <= 1e30)) {
            return Err(Error::invalid(format!("opengl texture_matrix: {x}: must be finite and at most 1e30")));
        }
        if rows[3] == DVec4::ZERO {
            return Err(Error::invalid("opengl texture_matrix: singular: its last row is 0, and so is every q"));
        }
        Ok(())
    }
}
