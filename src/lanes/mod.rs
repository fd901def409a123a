//! The vector type the stages are written in. The only room with `unsafe`.

/// An instruction set the stages can run on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Level(Kind);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Scalar,
    Wide,
}

impl Level {
    /// Levels this machine can run, slowest first: `scalar` and `wide` always.
    pub fn available() -> Vec<Self> {
        vec![Self(Kind::Scalar), Self(Kind::Wide)]
    }

    /// The name used on the command line: `scalar`, `wide`, ...
    pub fn name(self) -> &'static str {
        match self.0 {
            Kind::Scalar => "scalar",
            Kind::Wide => "wide",
        }
    }

    /// The fastest level of this machine.
    pub fn best() -> Self {
        Self(Kind::Wide)
    }
}
