//! What is measured at every step.

/// A number that each step of a run has, or has not while the memory holds no place yet.
///
/// *Winner* is the place that the core recalls by the agent's grid code alone, without its
/// position: the exact arg max of the similarity over all places (seed Section 3.3 B), asked after
/// the step has been taken in. The true position is written p, and all distances are in the frame
/// of the room.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Distance of the winner's stored position from p \[m\] (seed Eq. 11, the ATE). A place that
    /// was recruited at this very step counts; the paper does not say.
    RecallError,
    /// Distance of the nearest stored place from p \[m\]: no recall of a place can be better.
    OracleError,
    /// As [`Quantity::RecallError`], but the place recruited at this very step, if one was, is left
    /// out \[m\]: how well the memory knew what came (seed Fig. 15, which has the distance of the
    /// winner without saying whether the memory is asked before or after it learns).
    PredictionError,
    /// Distance from p of the place that answers the live agent \[m\]: what the service publishes.
    /// It is found by position, asked anew after every eighth of a field radius, and there is none
    /// beyond two field radii from all places.
    LiveError,
    /// Distance from p of the position decoded from the grid code alone, knowing only that the
    /// agent is in the room \[m\]. Asked at every tenth step.
    DecodedError,
    /// Distance from p of the pose that is published with the step \[m\].
    CausalError,
    /// Distance from p of the pose by motion alone \[m\].
    DeadReckoningError,
    /// Cosine of the activation vectors of all grid cells now and at the winner (seed Eqs. 6, 10).
    Cosine,
    /// exp(−(1 − cosine)/σ) (seed Eq. 9). The paper leaves σ open; here it makes 1/2 of a place one
    /// field radius away, averaged over directions, as the map's confidence does.
    PseudoActivation,
    /// The map's confidence in the winner (seed Eq. 8): 2^−(d/field radius)², where d is the
    /// distance at which codes are on average as alike as these two.
    Confidence,
    /// Cosine of the interference patterns I ∈ R³ now and at the winner (seed Eqs. 4 and 5), in the
    /// frame of the room, whose origin is a corner.
    InterferenceScore,
    /// Whether the live agent has a place that answers, 0 or 1.
    LiveAnswers,
    /// Places in memory.
    Places,
    /// Places recruited a step, over as many steps as a tenth of the walk has.
    Growth,
    /// Locations visited so far that lie farther than ε from all those counted before (seed Section
    /// 5.2 A). The paper leaves ε open; here it is the field radius, 0.25 m.
    UniqueLocations,
    /// Steps so far that ended within ε of a location counted before.
    Revisits,
    /// Landmarks in memory.
    Landmarks,
    /// Distance from p of the place that a view recalls by itself, before it is learned \[m\].
    ViewRecallError,
    /// How far a view is from what the place there remembers, before it is learned: one minus the
    /// cosine.
    ViewSurprise,
    /// Squared error of the published position in its deviations, per component: eᵀ P⁻¹ e / 3. Its
    /// mean is 1 where covariances are honest.
    PositionNees,
    /// The same of the rotation.
    RotationNees,
    /// The same of both together, over 6.
    PoseNees,
}

impl Quantity {
    /// All of them, in the order of their declaration.
    pub const ALL: [Self; 22] = [
        Self::RecallError,
        Self::OracleError,
        Self::PredictionError,
        Self::LiveError,
        Self::DecodedError,
        Self::CausalError,
        Self::DeadReckoningError,
        Self::Cosine,
        Self::PseudoActivation,
        Self::Confidence,
        Self::InterferenceScore,
        Self::LiveAnswers,
        Self::Places,
        Self::Growth,
        Self::UniqueLocations,
        Self::Revisits,
        Self::Landmarks,
        Self::ViewRecallError,
        Self::ViewSurprise,
        Self::PositionNees,
        Self::RotationNees,
        Self::PoseNees,
    ];

    /// Its position in [`Quantity::ALL`].
    pub(super) fn index(self) -> usize {
        self as usize
    }
}

/// One value for each quantity.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Each<T>([T; Quantity::ALL.len()]);

impl<T> Each<T> {
    /// Makes each value.
    pub(super) fn from_fn(mut make: impl FnMut(Quantity) -> T) -> Self {
        Self(Quantity::ALL.map(&mut make))
    }

    /// The values, each with its quantity.
    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = (Quantity, &mut T)> {
        Quantity::ALL.into_iter().zip(&mut self.0)
    }
}

impl<T> std::ops::Index<Quantity> for Each<T> {
    type Output = T;

    fn index(&self, quantity: Quantity) -> &T {
        &self.0[quantity.index()]
    }
}

impl<T> std::ops::IndexMut<Quantity> for Each<T> {
    fn index_mut(&mut self, quantity: Quantity) -> &mut T {
        &mut self.0[quantity.index()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_are_in_the_order_of_declaration() {
        for (index, quantity) in Quantity::ALL.into_iter().enumerate() {
            assert_eq!(quantity.index(), index);
        }
    }
}
