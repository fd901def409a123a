//! Pictures that prove themselves: a picture carries the scene that it was made of, and can be made again from that.
//!
//! ```text
//!  Scene, Volume, Picture --Provenance::of--> Provenance --metadata--> texts in a PNG or an OpenEXR file
//!                                                 ^                                  |
//!  Verdict <--verify: rendered again--------------+---------------read---------------'
//! ```
//!
//! | key | text |
//! |---|---|
//! | `slicestack.scene` | the scene as a scene file in TOML: each number as it was, presets and defaults resolved |
//! | `slicestack.scene.keys` | eight hexadecimal digits of the SHA-256 of each key's value, so that an edited key can be named |
//! | `slicestack.version` | the version of this crate |
//! | `slicestack.sha256` | SHA-256 of the pixels in f32: [`Picture::sha256`](crate::Picture::sha256) |
//! | `slicestack.volume.sha256` | [`Volume::sha256`](crate::Volume::sha256) |
//! | `slicestack.labels.sha256` | [`LabelMap::sha256`](crate::volume::LabelMap::sha256) of a label map beside the volume |
//!
//! Nothing of it says whose data it is or where it lies. The volume's path is left out, its file name too: medical files are often named after
//! the patient, and a picture travels further than its data. The fingerprint finds the file as surely. Of what a file's header says (names,
//! descriptions, dates) nothing is read. A built-in volume is named.

mod bounded;
mod folder;
mod provenance;
mod verify;

pub use bounded::{Bounded, Distance, MAX_PROOF, verify_bounded};
pub use folder::{Blessed, Checked, Outcome, bless, check, page};
pub use provenance::{Inputs, Provenance};
pub use verify::{PixelsDiffer, Verdict, verify};
