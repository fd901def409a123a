//! A scene as the parts of a volume render it.

use super::{Accumulation, Blend, Scene, SlabForm};
use crate::Result;

impl Scene {
    /// The same scene, rendered as parts of a volume are: no pixel ends early, no slabs become one, and sums keep what rounding adds to them.
    /// Its picture in one piece is the one that parts put together come within 2e-6 of.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] where the scene does not allow that.
    ///
    /// ```
    /// use slicestack::volume::phantom::Phantom;
    /// use slicestack::Scene;
    ///
    /// let scene = Scene::new(Phantom::SheppLogan.default_transfer(16)).in_parts()?;
    /// assert_eq!(scene.terminate(), 0.0);
    /// # Ok::<(), slicestack::Error>(())
    /// ```
    pub fn in_parts(&self) -> Result<Self> {
        let method = self.method().with_merge(false);
        let sums = self.blend() == Blend::Over && method.slab == SlabForm::Exponential;
        let method = if sums { method.with_accumulation(Accumulation::Compensated) } else { method };
        self.clone().with_terminate(0.0)?.with_method(method)
    }
}
