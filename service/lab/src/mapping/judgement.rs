//! Which matches hold, and the map that fits them best.

use cognitive_map::Digest;
use nalgebra::{Isometry3, Point3};
use pose_graph::{Graduation, Innovation, Kernel, PoseGraph, RelaxationSettings, Scale, Start};

use super::growth::Growth;
use super::recording::{Matches, Recording};

/// How far off a measurement may be. Of true ones with the errors that they state fewer than one in
/// 10⁸ are farther.
pub const GATE_DEVIATIONS: f64 = 6.0;

/// The same for recognised places, whose errors are a rough figure of how far apart two samples of
/// one place are taken.
const GATE_DEVIATIONS_OF_RECOGNISED: f64 = 3.0;

/// Scale of the kernel by which measurements are judged against one another: the gate in one
/// direction is 6, and at 4 a measurement that is as far off as that pulls with a tenth of its
/// force.
const DOUBT_SCALE: f64 = 4.0;

/// Times that matches are sorted and the map relaxed; hardly any change sides in the third.
const ROUNDS_MAX: usize = 8;

/// For each match, in the order of the recording, whether it holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Verdict(pub Vec<bool>);

impl Verdict {
    /// Number of matches that hold.
    pub fn n_accepted(&self) -> usize {
        self.0.iter().filter(|holds| **holds).count()
    }

    /// Number of matches that do not.
    pub fn n_rejected(&self) -> usize {
        self.0.len() - self.n_accepted()
    }
}

/// The best map of a whole recording.
#[derive(Clone, Debug)]
pub struct Refined {
    /// The poses, by step.
    pub poses: Vec<Isometry3<f64>>,
    /// The landmarks that were seen.
    pub landmarks: Vec<Point3<f64>>,
    /// Which matches hold.
    pub verdict: Verdict,
    /// χ² over motion and the matches that hold.
    pub chi_squared: f64,
    /// χ² at the best map of all matches, false or not. `None` for recognised places, of which half
    /// may be false.
    pub chi_squared_of_all: Option<f64>,
    /// Number of links, those of matches that do not hold among them.
    pub n_links: usize,
    /// Digest of the map.
    pub digest: Digest,
}

impl Refined {
    /// Relaxes the whole recording, from rotations first and with all matches. If every match is
    /// then nearer than the gate, that is the map. Otherwise some are false, and another map is
    /// tried, from the matches that `causal` believed; and where those are not most of them, or
    /// there is no causal verdict, one in which kernels that begin wide let the matches judge one
    /// another. Of each those matches are kept that fit, the rest are left out, and the map is
    /// relaxed again, until none changes sides. The map is the one on which Σ min(s, gate) is least
    /// over all matches.
    ///
    /// Recognised places are only judged by one another.
    pub fn of(recording: &Recording, causal: Option<&Verdict>) -> Self {
        let n = recording.steps.len();
        if matches!(recording.matches, Matches::Recognised(_)) {
            let (growth, verdict) = judge(recording, n);
            return Self::from_map(&growth, verdict, None);
        }
        let mut all = Growth::whole(recording, n, Kernel::Gaussian);
        relax(&mut all.map, Start::RotationFirst, Graduation::None);
        let of_all = all.map.chi_squared();
        let verdict = sorted(&all);
        if verdict.n_rejected() == 0 {
            return Self::from_map(&all, verdict, Some(of_all));
        }
        let mut best = settled(all.clone());
        if let Some(causal) = causal {
            let mut believed = all.clone();
            believed.switch(&causal.0);
            relax(&mut believed.map, Start::RotationFirst, Graduation::None);
            best = better(best, settled(believed));
        }
        // Wide kernels keep every false match in the factor, which it makes dense: they are the
        // last resort.
        if causal.is_none_or(|causal| causal.n_rejected() > causal.n_accepted()) {
            let (judged, _) = judge(recording, n);
            all.take_places(&judged);
            best = better(best, settled(all));
        }
        let (growth, verdict) = best;
        Self::from_map(&growth, verdict, Some(of_all))
    }

    fn from_map(growth: &Growth<'_>, verdict: Verdict, chi_squared_of_all: Option<f64>) -> Self {
        let map = &growth.map;
        Self {
            poses: growth.poses.iter().map(|&pose| *map.pose(pose)).collect(),
            landmarks: growth
                .landmarks
                .iter()
                .flatten()
                .map(|&point| map.point(point))
                .collect(),
            chi_squared: map.chi_squared(),
            chi_squared_of_all,
            n_links: map.n_links(),
            digest: map.digest(),
            verdict,
        }
    }
}

/// The squared error beyond which a match that measured so many directions is false.
pub(super) fn gate(matches: Matches, degrees: usize) -> f64 {
    let deviations = match matches {
        Matches::Measurements => GATE_DEVIATIONS,
        Matches::Recognised(_) => GATE_DEVIATIONS_OF_RECOGNISED,
    };
    Innovation::limit(degrees, deviations)
}

/// The map of the first `n` steps, from motion on, in which matches judge one another; and which of
/// them hold there.
pub(super) fn judge(recording: &Recording, n: usize) -> (Growth<'_>, Verdict) {
    let doubt = Kernel::GemanMcClure(Scale::new(DOUBT_SCALE).expect("a positive constant"));
    let kernel = match recording.matches {
        Matches::Measurements => doubt,
        Matches::Recognised(kernel) => kernel,
    };
    let mut growth = Growth::whole(recording, n, kernel);
    relax(&mut growth.map, Start::Here, Graduation::FromWide);
    let verdict = sorted(&growth);
    growth.switch(&verdict.0);
    (growth, verdict)
}

/// Sorts and relaxes until no match changes sides.
fn settled(mut growth: Growth<'_>) -> (Growth<'_>, Verdict) {
    let mut verdict = sorted(&growth);
    for _ in 0..ROUNDS_MAX {
        growth.switch(&verdict.0);
        relax(&mut growth.map, Start::Here, Graduation::None);
        let next = sorted(&growth);
        if next == verdict {
            break;
        }
        verdict = next;
    }
    growth.switch(&verdict.0);
    (growth, verdict)
}

/// The map that explains all matches at the least cost; of two as good as one another the first.
fn better<'a>(
    first: (Growth<'a>, Verdict),
    second: (Growth<'a>, Verdict),
) -> (Growth<'a>, Verdict) {
    if truncated(&second.0) < truncated(&first.0) {
        second
    } else {
        first
    }
}

/// Which matches fit the map as it is.
fn sorted(growth: &Growth<'_>) -> Verdict {
    let matches = growth.recording.matches;
    let fits = growth
        .judged
        .iter()
        .map(|judged| growth.map.squared_error(judged.link) <= gate(matches, judged.degrees));
    Verdict(fits.collect())
}

/// χ² of motion, and Σ min(s, gate) over all matches.
fn truncated(growth: &Growth<'_>) -> f64 {
    let rejected: f64 = growth
        .judged
        .iter()
        .filter(|judged| !growth.map.is_on(judged.link))
        .map(|judged| gate(growth.recording.matches, judged.degrees))
        .sum();
    growth.map.chi_squared() + rejected
}

fn relax(map: &mut PoseGraph, start: Start, graduation: Graduation) {
    map.relax(&RelaxationSettings {
        start,
        graduation,
        ..RelaxationSettings::default()
    });
}
