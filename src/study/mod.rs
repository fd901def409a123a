//! What error costs, and what holds when things get extreme.
//!
//! ```text
//!  scene, volume --> reference in f64 --.
//!        '---> pictures: method x slices -+--> error, time --> Record --> page, CSV, JSON, Markdown, SVG, PNG
//!        '---> stages, sizes: time -------'
//!  extreme scenes ---> what is promised, what was measured, holds ---> the same kinds of file
//! ```
//! The first half is the work-precision diagram of the solvers of differential equations: one curve for each method, error
//! against run time. The second half takes the compositing loop as what it is, a one-step integrator for the stiff linear
//! equation dC/ds = -kappa C + q, and drives it to the ends of its numbers.

mod advice;
mod algorithms;
mod balance;
mod clock;
mod cost;
mod details;
mod gradients;
mod hits;
mod joint_plot;
mod lessons;
mod methods;

mod plot;
mod precision;
mod record;
mod report;

mod observer;
mod stability;
mod stages;
mod transfer_plot;

pub use methods::{METHODS, NamedMethod};
pub use precision::{Options, Study, study};
pub use record::{
    Advice, AlgorithmRow, Balance, Cost, Detail, GradientKind, HitKind, MethodRecord, Point, PreIntegration, Record, Setting, Shared,
    SlicesFor, StageTime,
};

pub use joint_plot::joint_histogram_png;
pub use lessons::{LESSONS, Lesson, Shown};
pub use report::{File, scene_files, stability_files};
pub use stability::{CountPoint, RiemannPoint, Row, Stability, stability};
pub use transfer_plot::{Units, transfer_png};
