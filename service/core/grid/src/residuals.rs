//! Residuals of a position that is to be near points of several modules and in a box.

use nalgebra::{Matrix3, Vector3};

use crate::{GridModules, Lattice};

/// The share η of the box in the squared distance. A quarter to a half of a typical tolerance makes
/// the ball that has to be searched smallest.
pub(super) const BOX_SHARE: f64 = 0.006;

/// Distances of the modules' points and of the box's centre from the position that fits all best,
/// in spacings.
pub(super) struct Residuals<'a> {
    lattices: Vec<&'a Lattice>,
    /// Σ 1/sₘ² \[1/m²\].
    pub(super) stiffness: f64,
    /// The weights w of the box \[1/m²\].
    pub(super) box_weight: Vector3<f64>,
    /// What each module's point adds to the position.
    pub(super) weights: Vec<Matrix3<f64>>,
}

impl<'a> Residuals<'a> {
    pub(super) fn new(modules: &'a GridModules, members: &[usize], levels: [i32; 3]) -> Self {
        let lattices: Vec<_> = members.iter().map(|&m| &modules.lattices()[m]).collect();
        let finest_m = modules.lattices()[0].spacing_m();
        let stiffness: f64 = lattices
            .iter()
            .map(|lattice| lattice.spacing_m().powi(-2))
            .sum();
        let box_weight = Vector3::from(levels).map(|level| {
            let half_m = finest_m * f64::from(level).exp2();
            BOX_SHARE / (3.0 * half_m * half_m)
        });
        let weight = |lattice: &&Lattice| {
            let share = box_weight.map(|w| lattice.spacing_m().powi(-2) / (stiffness + w));
            Matrix3::from_diagonal(&share)
        };
        Self {
            weights: lattices.iter().map(weight).collect(),
            lattices,
            stiffness,
            box_weight,
        }
    }

    /// Module and axis of each dimension.
    pub(super) fn axes(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        (0..self.lattices.len()).flat_map(|module| (0..3).map(move |axis| (module, axis)))
    }

    /// A lattice axis of a module \[m\].
    fn axis(&self, module: usize, axis: usize) -> Vector3<f64> {
        self.lattices[module].basis().column(axis).into()
    }

    /// The residuals of a shift of each module's point by each of its lattice axes.
    pub(super) fn basis(&self) -> Vec<Vec<f64>> {
        self.axes()
            .map(|(module, axis)| self.shifted(module, &self.axis(module, axis)))
            .collect()
    }

    /// What a shift of one module's point \[m\] does to the residuals of all modules and of the
    /// box.
    pub(super) fn shifted(&self, module: usize, by: &Vector3<f64>) -> Vec<f64> {
        let position = self.weights[module] * by;
        let mut residuals = Vec::with_capacity(3 * self.lattices.len() + 3);
        for (other, lattice) in self.lattices.iter().enumerate() {
            let point = if other == module {
                *by
            } else {
                Vector3::zeros()
            };
            residuals.extend(((point - position) / lattice.spacing_m()).iter());
        }
        let root = self.box_weight.map(f64::sqrt);
        residuals.extend(position.component_mul(&root).iter());
        residuals
    }

    /// How far the position moves \[m\] when the modules' points move by so many axes each.
    pub(super) fn moved(&self, times: &[f64]) -> Vector3<f64> {
        self.axes()
            .zip(times)
            .map(|((module, axis), times)| self.weights[module] * self.axis(module, axis) * *times)
            .sum()
    }
}
