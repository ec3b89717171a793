//! Revisits: an agent comes to where it, or another one, has been before, and the views are alike.
//!
//! How alike two views are says how far apart they were taken; that is learned for each channel from the views of the last
//! few metres, whose distances are known from motion ([`reach`]). A *passage* is a stretch of views that are more alike to
//! those of one earlier stretch than chance would have them ([`passage`]). At its end the distances between both stretches
//! are fitted like those of a trilateration, which gives the relative pose of the two as far as they determine it ([`fit`]).

mod fit;
mod passage;
mod reach;
mod revisits;
mod track;
mod view;

pub(super) use fit::{NEAR, OPEN_DISTANCES, OPEN_RAD, Range, equations, lay_roughly, moved, twist};
pub(super) use passage::{Passage, Reference};
pub(super) use reach::Kernel;
pub(super) use revisits::{ALIKE_MAX, Felt, Revisits};
pub(super) use track::{read_all, write_all};
pub(super) use view::{Likeness, View, read_vector, write_vector};
