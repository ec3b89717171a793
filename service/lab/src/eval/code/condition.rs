//! The ways in which codes are damaged.

use super::cue::Damage;
use super::protocol::CodeProtocol;

/// A row of the report: what is wrong with its codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Condition {
    /// Its name in the report.
    pub name: &'static str,
    jittered: bool,
    noisy: bool,
    /// Number of modules erased; every choice of so many is tried.
    erased: usize,
}

impl Condition {
    /// All of them, in the order of the report. With fewer than three modules those that would
    /// leave none are left out.
    pub const ALL: [Self; 8] = [
        Self::new("whole", false, false, 0),
        Self::new("jittered", true, false, 0),
        Self::new("noisy", false, true, 0),
        Self::new("one erased", false, false, 1),
        Self::new("two erased", false, false, 2),
        Self::new("jittered, two erased", true, false, 2),
        Self::new("noisy, one erased", false, true, 1),
        Self::new("noisy, two erased", false, true, 2),
    ];

    const fn new(name: &'static str, jittered: bool, noisy: bool, erased: usize) -> Self {
        Self {
            name,
            jittered,
            noisy,
            erased,
        }
    }

    /// The damage for each choice of erased modules; empty when no module would be left.
    pub fn damages(&self, protocol: &CodeProtocol) -> Vec<Damage> {
        let modules = protocol.settings.grid_modules;
        if self.erased >= modules {
            return Vec::new();
        }
        let damage = |erased| Damage {
            jitter_m: if self.jittered {
                protocol.jitter_m
            } else {
                0.0
            },
            phase_noise_turns: if self.noisy {
                protocol.phase_noise_turns
            } else {
                0.0
            },
            erased,
        };
        choices(modules, self.erased)
            .into_iter()
            .map(damage)
            .collect()
    }
}

/// Every choice of `count` of the numbers below `modules`, each in ascending order.
fn choices(modules: usize, count: usize) -> Vec<Vec<usize>> {
    if count == 0 {
        return vec![Vec::new()];
    }
    let mut all = Vec::new();
    for last in count - 1..modules {
        for mut choice in choices(last, count - 1) {
            choice.push(last);
            all.push(choice);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_choice_of_erased_modules_is_tried_once() {
        let protocol = CodeProtocol::default();
        let modules = protocol.settings.grid_modules;
        for condition in Condition::ALL {
            let mut erased: Vec<_> = condition
                .damages(&protocol)
                .into_iter()
                .map(|damage| damage.erased)
                .collect();
            let expected = match condition.erased {
                0 => 1,
                1 => modules,
                _ => modules * (modules - 1) / 2,
            };
            erased.sort();
            erased.dedup();
            assert_eq!(erased.len(), expected, "{}", condition.name);
        }
        let mut alone = protocol;
        alone.settings.grid_modules = 1;
        assert!(Condition::ALL[4].damages(&alone).is_empty());
    }
}
