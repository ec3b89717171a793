//! Background model: contacts with an unknown object, predicted from the surfaces of the library.

use std::collections::BTreeMap;
use std::f64::consts::LN_2;

use nalgebra::UnitQuaternion;

use crate::contact::Contact;
use crate::library::ObjectLibrary;
use crate::numeric::log_sum;
use crate::object_id::ObjectId;
use crate::translations::unknown_contact::{PerceptLogs, unknown_contact};

/// Log-likelihoods of the contacts under an unknown object.
///
/// They depend on the object for which the unknown one would be taken: that one's places do not
/// count. When another object comes to be the best, they would rise by all that the best one had
/// earned so far. So they rise by one contact after the other only, each by the object that was the
/// best before; they fall at once.
#[derive(Clone, Debug, Default)]
pub(crate) struct BackgroundModel {
    /// Sums over all contacts so far, by the object for which it would be taken.
    sums: BTreeMap<ObjectId, PerceptLogs>,
    /// The object for which it would be taken after the contacts so far.
    best: Option<ObjectId>,
    /// Of all contacts so far.
    pub(crate) logs: UnknownLogs,
}

/// Log-likelihoods of contacts under an unknown object, by what it is predicted from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct UnknownLogs {
    /// From the library alone: its percepts are either like those there or carry no information,
    /// each with probability ½.
    pub(crate) library: f64,
    /// From the nearest contact before: its levels change over the surface like those of the
    /// library, from whatever they are. None before levels could be compared.
    pub(crate) nearest: Option<f64>,
}

impl UnknownLogs {
    /// By all of them, each with the same probability.
    pub(crate) fn log(self) -> f64 {
        let both = |nearest| log_sum([self.library, nearest].into_iter()) - LN_2;
        self.nearest.map_or(self.library, both)
    }

    /// All with so much more.
    pub(crate) fn plus(self, log: f64) -> Self {
        Self {
            library: self.library + log,
            nearest: self.nearest.map(|nearest| nearest + log),
        }
    }
}

/// Log densities of a contact with an unknown object.
#[derive(Clone, Debug, Default)]
pub(crate) struct UnknownContact {
    /// By the object for which it would be taken.
    pub(crate) of_objects: BTreeMap<ObjectId, PerceptLogs>,
    /// After the contacts before: what the contact adds to the unknown object's log-likelihood.
    pub(crate) log: f64,
}

impl BackgroundModel {
    /// Adds a contact: see [`unknown_contact`]; `continued` is the log density of its position on a
    /// surface that goes on as the contacts before tell.
    pub(crate) fn touch(
        &mut self,
        library: &ObjectLibrary,
        rotations: &[UnitQuaternion<f64>],
        pair: (&Contact, &Contact),
        drift_m2: f64,
        continued: Option<f64>,
    ) -> UnknownContact {
        let mut of_objects = unknown_contact(library, rotations, pair, drift_m2);
        if let Some(log) = continued {
            for own in of_objects.values_mut() {
                own.go_on(log);
            }
        }
        let (own, before) = (self.logs, self.logs_of_best());
        for (object, logs) in &of_objects {
            self.sums.entry(*object).or_default().add(logs);
        }
        if let Some((now, before)) = self.logs_of_best().zip(before) {
            self.logs.library += now.library - before.library;
        }
        if let Some(said) = self.best.and_then(|best| of_objects.get(&best)) {
            let compared = own.nearest.is_some() || said.changing.is_some();
            let nearest = own.nearest.unwrap_or(own.library) + said.changing();
            self.logs.nearest = compared.then_some(nearest);
        }
        let log = self.logs.log() - own.log();
        UnknownContact { of_objects, log }
    }

    /// After a contact: the object for which the unknown one would be taken now.
    pub(crate) fn settle(&mut self, best: Option<ObjectId>) {
        self.best = best;
        if let Some(logs) = self.logs_of_best() {
            self.logs.library = self.logs.library.min(logs.library);
            let least = |own: f64| own.min(logs.nearest.unwrap_or(own));
            self.logs.nearest = self.logs.nearest.map(least);
        }
    }

    /// Of all contacts so far, taken for the best object.
    fn logs_of_best(&self) -> Option<UnknownLogs> {
        let best = self.best?;
        let sums = self.sums.get(&best).copied().unwrap_or_default();
        Some(UnknownLogs {
            library: log_sum([sums.alike, sums.bare].into_iter()) - LN_2,
            nearest: sums.changing,
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, UnitQuaternion};

    use super::BackgroundModel;
    use crate::{
        Contact, ModelSettings, ObjectId, ObjectLibrary, ObjectModel, Orientation, Recognition,
        Verdict,
    };

    /// A contact with the `k`-th place of a rod.
    fn contact(k: u16, level: f64) -> Contact {
        let at = Point3::new(0.02 * f64::from(k), 0.0, 0.0);
        Contact::at(at, 0.001).with_level(0, level, 0.2)
    }

    /// Rods of one shape: three with similar levels, and one with others.
    fn rods() -> ObjectLibrary {
        let mut library = ObjectLibrary::default();
        for (id, factor, offset) in [(0, 1, 0.0), (1, 5, 0.0), (2, 7, 0.0), (3, 5, 20.0)] {
            // The last one is known in finer places than the others.
            let spacing_m = if id == 3 { 0.004 } else { 0.01 };
            let settings = ModelSettings {
                spacing_m,
                ..ModelSettings::default()
            };
            let mut model = ObjectModel::new(settings);
            for k in 0..12 {
                model.learn(&contact(k, f64::from(k * factor % 13) + offset));
            }
            library.put(ObjectId(id), model);
        }
        library
    }

    #[test]
    fn an_unknown_object_rises_by_no_more_than_one_contact_says() {
        let library = rods();
        let mut background = BackgroundModel::default();
        let none = [UnitQuaternion::identity()];
        let mut falls = 0;
        for k in 0..11 {
            // What it would be taken for changes at each contact.
            background.settle(Some(ObjectId(u32::from(k % 4))));
            let levels = [k, k + 1].map(|k| f64::from(k * 5 % 13));
            let [before, now] = [contact(k, levels[0]), contact(k + 1, levels[1])];
            let log = background.logs.log();
            let said = background.touch(&library, &none, (&before, &now), 0.0, None);
            let most = said.of_objects.values();
            let most = most.flat_map(|logs| [logs.alike, logs.bare, logs.changing()]);
            let most = most.fold(f64::NEG_INFINITY, f64::max);
            assert!(background.logs.log() - log <= most + 1e-9, "{k}: {said:?}");
            let log = background.logs.log();
            background.settle(Some(ObjectId(u32::from((k + 1) % 4))));
            assert!(background.logs.log() <= log, "{k}");
            falls += u32::from(background.logs.log() < log);
        }
        assert!(falls > 0, "no other object explains it better");
    }

    #[test]
    fn a_known_shape_with_unknown_levels_is_unknown() {
        let library = rods();
        for offset in [-40.0, 20.0, 40.0, 1000.0] {
            let mut recognition = Recognition::new(&Orientation::Known);
            for k in 0..12 {
                let level = f64::from(k * 7 % 13) + offset;
                recognition.touch(&library, contact(k, level));
                let verdict = recognition.posterior(&library).verdict();
                assert!(
                    !matches!(verdict, Verdict::Object(_)),
                    "{offset}: {verdict:?} after {}",
                    k + 1
                );
            }
            let posterior = recognition.posterior(&library);
            assert!(posterior.unknown > 0.95, "{offset}: {}", posterior.unknown);
        }
    }
}
