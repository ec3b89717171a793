//! Recognition: which stored map explains a sequence of contacts, and in which pose.
//!
//! "Which object is this", "where did I wake up" and "how do our frames meet" are one question. An
//! *episode* is a sequence of [`Contact`]s in a frame of its own, kept by path integration. A *map* is
//! an [`ObjectModel`], learned from contacts; an [`ObjectLibrary`] holds those that may be meant. A
//! [`Recognition`] gathers log evidence over hypotheses (map, pose of the episode's frame in the map's)
//! while contacts come in, and answers with a [`Posterior`]. Nothing is ever ruled out by one contact:
//! each is explained by the map with some density, or by an outlier's.
//!
//! ```
//! use cognitive_map::recognition::{
//!     Contact, ModelSettings, ObjectId, ObjectLibrary, ObjectModel, Orientation, Recognition, Verdict,
//! };
//! use nalgebra::Point3;
//!
//! // Two rods of seven places; the levels felt along them differ.
//! let mut library = ObjectLibrary::default();
//! for (id, levels) in [(1, [1., 2., 3., 4., 5., 6., 7.]), (2, [1., 3., 2., 7., 4., 5., 6.])] {
//!     let mut model = ObjectModel::new(ModelSettings { spacing_m: 0.01, ..ModelSettings::default() });
//!     for (k, level) in levels.into_iter().enumerate() {
//!         let at = Point3::new(0.02 * k as f64, 0.0, 0.0);
//!         model.learn(&Contact::at(at, 0.001).with_level(0, level, 0.1));
//!     }
//!     library.put(ObjectId(id), model);
//! }
//!
//! // The second, felt from an unknown start.
//! let mut recognition = Recognition::new(&Orientation::Known);
//! for (k, level) in [(2, 2.0), (3, 7.0), (1, 3.0)] {
//!     let at = Point3::new(0.02 * f64::from(k) - 5.0, 3.0, 1.0);
//!     recognition.touch(&library, Contact::at(at, 0.001).with_level(0, level, 0.1));
//! }
//! let posterior = recognition.posterior(&library);
//! assert_eq!(posterior.verdict(), Verdict::Object(ObjectId(2)));
//! ```

mod asking;
mod bricks;
mod cells;
mod contact;
mod crowd;
mod deviation;
mod encounter;
mod episode;
mod facet;
mod feeling;
mod group;
mod halves;
mod library;
mod model;
mod nearby;
mod nearest;
mod orientation;
mod pairs;
mod poses;
mod posterior;
mod ranks;
mod reaches;
mod relief;
mod shifts;
mod spots;
mod strain;
mod strangers;
mod surface;
#[cfg(test)]
mod tests;

pub use asking::NextTouch;
pub use contact::{Contact, Felt, Reached, Seen};
pub use episode::Recognition;
pub use library::{ObjectId, ObjectLibrary};
pub use model::{LevelMemory, ModelPlace, ModelSettings, ObjectModel};
pub use orientation::Orientation;
pub use posterior::{PoseEstimate, Posterior, SURE, Verdict};
