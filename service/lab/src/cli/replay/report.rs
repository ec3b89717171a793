//! The errors of a replayed team.

use std::collections::BTreeMap;

use cogmap::cli::output;
use cogmap_lab::nees::{Nees, NeesMeans};
use serde::Serialize;
use serde_json::Value;

use super::case::Case;
use super::errors::{Errors, mean};
use super::outcome::{Outcome, RobotOutcome, Timing};
use super::scoring::Scoring;
use super::setting::Setting;
use super::team::{Known, Team};

/// What a replay shows. Errors are means over the robots, of those that found their place in the
/// map. What the data do not tell, or a service does not, is null.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    /// Which start poses the robots were told.
    start_pose: &'static str,
    /// Settings of the space that are not the default.
    settings: BTreeMap<String, Value>,
    samples: u64,
    /// Of the map; where there are several, robots have it.
    digest: Option<String>,
    places: u64,
    trips: u64,
    landmarks: u64,
    /// Closures that are believed in the end.
    closures: Option<u64>,
    #[serde(flatten)]
    errors: Errors,
    /// Sightings of landmarks and of robots that counted, and that were refused.
    accepted: u64,
    rejected: u64,
    consistency: Consistency,
    /// Of a replay straight into the core: times that samples took \[ms\].
    update_ms: Option<Timing>,
    /// Likewise: times of relaxations of the past, which a service does beside them \[ms\].
    relaxation_ms: Option<Timing>,
    /// Recorded time over the time that it took in the core.
    real_time_factor: Option<f64>,
    robots: BTreeMap<String, RobotReport>,
}

/// Errors of one robot. None for a robot that never found its place.
#[derive(Debug, Serialize)]
struct RobotReport {
    samples: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    digest: Option<String>,
    #[serde(flatten)]
    errors: Errors,
    /// When it found its place \[s\] after the start.
    placed_after_s: Option<f64>,
    accepted: u64,
    rejected: u64,
    consistency: Consistency,
}

/// How honest the covariances are: both are 1 where they are, and more where they are too small.
#[derive(Clone, Copy, Debug, Serialize)]
struct Consistency {
    /// Normalised estimation error squared of the position in the plane, per component, once a
    /// second (of a replay straight into the core).
    nees_mean: Option<f64>,
    /// The same by component, along the axes of the map.
    nees: Option<NeesMeans>,
    /// Normalised innovation squared of the accepted sightings, per component.
    nis_mean: Option<f64>,
}

impl Report {
    /// Compares what came out with the truth.
    pub(super) fn of(case: &Case, outcomes: &[Outcome], changed: &[Setting]) -> Self {
        let (mut robots, mut nees) = (BTreeMap::new(), Nees::default());
        let nothing = RobotOutcome::default();
        let has_one_map = outcomes.len() == 1;
        for (team, outcome) in case.teams.iter().zip(outcomes) {
            for (name, known) in &team.robots {
                let came_out = outcome.robots.get(name).unwrap_or(&nothing);
                let of_robot = case.scoring.nees(came_out, known);
                let of = (&case.scoring, of_robot.means());
                nees.add_all(&of_robot);
                let mut robot = RobotReport::of(of, team, (name, known), came_out);
                robot.digest = (!has_one_map).then(|| outcome.digest.clone());
                robots.insert(name.clone(), robot);
            }
        }
        let sum = |value: fn(&Outcome) -> u64| outcomes.iter().map(value).sum();
        let timing = |times_s: fn(&Outcome) -> &[f64]| {
            Timing::of(outcomes.iter().flat_map(times_s).copied().collect())
        };
        let update_ms = timing(|outcome| &outcome.times_s);
        let relaxation_ms = timing(|outcome| &outcome.relaxations_s);
        let lasted_s = case.teams.iter().map(lasted_s).sum::<f64>();
        let of = |value: fn(&RobotReport) -> Option<f64>| mean(robots.values().filter_map(value));
        Self {
            start_pose: case.start_pose,
            settings: changed
                .iter()
                .map(|setting| (setting.name.clone(), setting.value.clone()))
                .collect(),
            samples: sum(|outcome| outcome.samples),
            digest: has_one_map.then(|| outcomes[0].digest.clone()),
            places: sum(|outcome| outcome.places),
            trips: sum(|outcome| outcome.trips),
            landmarks: sum(|outcome| outcome.landmarks),
            closures: outcomes.iter().map(|outcome| outcome.closures).sum(),
            errors: Errors::means(&errors_of(&robots)),
            accepted: robots.values().map(|robot| robot.accepted).sum(),
            rejected: robots.values().map(|robot| robot.rejected).sum(),
            consistency: Consistency {
                nees_mean: of(|robot| robot.consistency.nees_mean),
                nees: nees.means(),
                nis_mean: of(|robot| robot.consistency.nis_mean),
            },
            update_ms,
            relaxation_ms,
            real_time_factor: update_ms
                .filter(|_| case.scoring.is_recorded)
                .map(|update| {
                    lasted_s / (update.total_s + relaxation_ms.map_or(0.0, |it| it.total_s))
                }),
            robots,
        }
    }

    /// The errors of each robot, by name.
    pub(super) fn robots(&self) -> impl Iterator<Item = (&str, &Errors)> {
        let robots = self.robots.iter();
        robots.map(|(name, robot)| (name.as_str(), &robot.errors))
    }

    /// The median over the robots of each error.
    pub(super) fn medians(&self) -> Errors {
        Errors::medians(&errors_of(&self.robots))
    }
}

impl RobotReport {
    fn of(
        (scoring, nees): (&Scoring, Option<NeesMeans>),
        team: &Team,
        (name, known): (&str, &Known),
        came_out: &RobotOutcome,
    ) -> Self {
        let placed = came_out.causal.first().zip(known.reckoned.first());
        Self {
            samples: team.samples_of(name),
            digest: None,
            errors: Errors::of(scoring, known, came_out),
            placed_after_s: placed
                .map(|(row, begun)| (row.stamp_ns - begun.stamp_ns) as f64 * 1e-9),
            accepted: came_out.evidence.accepted,
            rejected: came_out.evidence.refused,
            consistency: Consistency {
                nees_mean: nees.map(|nees| nees.position),
                nees,
                nis_mean: came_out.evidence.nis_mean,
            },
        }
    }
}

fn errors_of(robots: &BTreeMap<String, RobotReport>) -> Vec<&Errors> {
    robots.values().map(|robot| &robot.errors).collect()
}

/// How long a team was out \[s\]: from its first motion to its last, or what its robots were out
/// together, where they came one after the other.
fn lasted_s(team: &Team) -> f64 {
    let spans = team.robots.values().filter_map(|known| {
        let (first, last) = (known.reckoned.first()?, known.reckoned.last()?);
        Some([first.stamp_ns, last.stamp_ns])
    });
    let lasted_s = |[first, last]: [i64; 2]| last.saturating_sub(first) as f64 * 1e-9;
    let sum_s: f64 = spans.clone().map(lasted_s).sum();
    let whole = spans.reduce(|one, other| [one[0].min(other[0]), one[1].max(other[1])]);
    whole.map_or(0.0, lasted_s).min(sum_s)
}

impl Report {
    /// What samples and relaxations took, as text.
    fn print_times(&self) -> anyhow::Result<()> {
        if let Some(timing) = self.update_ms {
            let factor = self.real_time_factor;
            let factor = factor.map_or(String::new(), |x| format!("{x:.0} times real time; "));
            output::line(&format!(
                "{factor}a sample p50 {:.1} us, p99 {:.1} us, max {:.1} ms",
                timing.p50 * 1e3,
                timing.p99 * 1e3,
                timing.max,
            ))?;
        }
        if let Some(timing) = self.relaxation_ms {
            output::line(&format!(
                "{} relaxations of the past beside them, p50 {:.1} ms, max {:.1} ms",
                timing.count, timing.p50, timing.max,
            ))?;
        }
        Ok(())
    }

    /// As text.
    pub(super) fn print(&self) -> anyhow::Result<()> {
        let settings = self
            .settings
            .iter()
            .map(|(name, value)| format!(", {name} = {value}"));
        output::line(&format!(
            "start pose: {}; default settings{}",
            self.start_pose,
            settings.collect::<String>()
        ))?;
        output::line(
            "robot      samples   dead reckoning [m]    causal [m]            refined [m]",
        )?;
        output::line(
            "                     plain    aligned       plain    aligned      plain    aligned",
        )?;
        for (name, robot) in &self.robots {
            let (samples, errors) = (robot.samples, robot.errors.cells());
            output::line(&format!("{name:<9} {samples:>8}   {errors}"))?;
        }
        let (samples, errors) = (self.samples, self.errors.cells());
        output::line(&format!("mean      {samples:>8}   {errors}"))?;
        output::line(&format!(
            "{} sightings accepted, {} refused; squared errors over expected: {} of positions, {} of sightings",
            self.accepted,
            self.rejected,
            ratio(self.consistency.nees_mean),
            ratio(self.consistency.nis_mean),
        ))?;
        if let Some(nees) = self.consistency.nees {
            let heading = ratio(nees.heading);
            output::line(&format!(
                "by component: x {:.2}, y {:.2}, heading {heading}",
                nees.x, nees.y
            ))?;
        }
        self.print_times()?;
        let closures = self
            .closures
            .map_or(String::new(), |n| format!("{n} closures, "));
        output::line(&format!(
            "{} places, {} trips, {} landmarks, {closures}digest {}",
            self.places,
            self.trips,
            self.landmarks,
            self.digest.as_deref().unwrap_or("of each space")
        ))?;
        Ok(())
    }
}

fn ratio(value: Option<f64>) -> String {
    value.map_or("none".to_owned(), |value| format!("{value:.2}"))
}
