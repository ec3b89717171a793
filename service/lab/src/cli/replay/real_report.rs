//! What all sets of recordings measure together, as JSON and as text.

use std::collections::BTreeMap;

use cogmap::cli::output;
use cogmap_lab::coverage::PROMISED;
use cogmap_lab::eval::sequences::Calibration;
use serde::Serialize;

use super::columns::columns;
use super::csv_waking::{FALSE_CLAIM_M, Waking};
use super::errors::Errors;
use super::measured::{Figures, Measured};
use super::position_claims::{PositionClaims, Start};
use super::sequence_recall::{CLAIM, SequenceRow};

/// What all sets measure. What does not apply to a set is left out.
#[derive(Debug, Serialize)]
pub(super) struct RealReport {
    /// By name.
    sets: BTreeMap<String, Measured>,
    calibration: Claims,
    /// Sets that could not be measured, and why.
    unread: BTreeMap<String, String>,
}

/// What was claimed in all sets, and how often it was right.
#[derive(Debug, Serialize)]
struct Claims {
    /// Live positions, within the ellipses of their covariances.
    positions: Vec<PositionClaims>,
    /// Answers to the last views, by their probability.
    answers: Calibration,
    /// Matches of views that maps held in the end, by their probability.
    view_matches: Calibration,
}

impl RealReport {
    /// Of sets that could be measured, and of those that could not.
    pub(super) fn new(sets: BTreeMap<String, Measured>, unread: BTreeMap<String, String>) -> Self {
        let mut answers = Calibration::default();
        let mut view_matches = Calibration::default();
        let mut positions = BTreeMap::<Start, PositionClaims>::new();
        for measured in sets.values() {
            answers.add_all(&measured.answers());
            view_matches.add_all(&measured.view_matches);
            for claims in &measured.positions {
                let start = claims.start;
                { positions.entry(start) }
                    .or_insert_with(|| PositionClaims::new(start))
                    .add_all(claims);
            }
        }
        let positions = positions.into_values().collect();
        Self {
            sets,
            calibration: Claims {
                positions,
                answers,
                view_matches,
            },
            unread,
        }
    }

    /// Why sets could not be measured, if there are such.
    pub(super) fn complaint(&self) -> Option<String> {
        let all = self.unread.iter().map(|(set, why)| format!("{set}: {why}"));
        let all = all.collect::<Vec<_>>().join("; ");
        (!all.is_empty()).then_some(all)
    }

    /// As text.
    pub(super) fn print(&self) -> anyhow::Result<()> {
        let tables = [
            self.told(),
            self.sessions(),
            self.routes(),
            self.positions(),
            self.bins(
                "answers to the last views, by their probability",
                Measured::answers,
            ),
            self.bins(
                "matches of views that maps held in the end, by their probability",
                |measured| measured.view_matches.clone(),
            ),
        ];
        let tables: Vec<String> = tables.into_iter().flatten().collect();
        Ok(output::line(&tables.join("\n\n"))?)
    }

    fn told(&self) -> Option<String> {
        let rows = self.sets.iter().flat_map(|(set, measured)| {
            let agents = match &measured.figures {
                Figures::Told { agents } => Some(agents),
                _ => None,
            };
            let agents = agents.into_iter().flatten();
            agents.map(|(agent, errors)| told_row(set, agent, errors))
        });
        table(
            "told where they start: RMSE of position after the best rigid motion in the plane [m]",
            (2, &["set", "agent", "dead reckoning", "causal", "refined"]),
            rows,
        )
    }

    fn sessions(&self) -> Option<String> {
        let rows = self.sets.iter().filter_map(|(set, measured)| {
            let Figures::Sessions { taught, waking } = &measured.figures else {
                return None;
            };
            Some(session_row(set, *taught, waking))
        });
        let first = format!("first over {FALSE_CLAIM_M} m");
        let head = [
            "set",
            "taught",
            "woken",
            "covered",
            "placed",
            "median error [m]",
            &first,
            "placed of uncovered",
            "wrong floor",
        ];
        table("woken up where others were taught", (1, &head), rows)
    }

    fn routes(&self) -> Option<String> {
        let rows = self.sets.iter().flat_map(|(set, measured)| {
            let recall = match &measured.figures {
                Figures::Route(recall) => Some(recall),
                _ => None,
            };
            recall.into_iter().flat_map(move |recall| {
                let rows = recall.rows.iter();
                rows.map(move |row| route_row(set, &recall.asked.taught, row))
            })
        });
        let head = [
            "set",
            "agent",
            "taught",
            "questions",
            "right",
            &format!("told with {CLAIM}"),
            "of these right",
        ];
        table(
            "recognised by their last views on another's route",
            (3, &head),
            rows,
        )
    }

    fn positions(&self) -> Option<String> {
        let of_sets = self.sets.iter().flat_map(|(set, measured)| {
            let claims = measured.positions.iter();
            claims.map(|claims| position_row(set, claims))
        });
        let of_all = &self.calibration.positions;
        let of_all = of_all.iter().filter(|_| self.sets.len() > 1);
        let of_all = of_all.map(|claims| position_row("all", claims));
        let promised = PROMISED.map(|share| percent(Some(share), 0));
        let mut head = vec!["set", "start", "agents", "poses"];
        head.extend(promised.iter().map(String::as_str));
        table(
            "live positions within the ellipse that promises",
            (2, &head),
            of_sets.chain(of_all),
        )
    }

    /// What was said to be so probable in each set, and how often it was right.
    fn bins(&self, title: &str, of: impl Fn(&Measured) -> Calibration) -> Option<String> {
        let rows = self.sets.iter().flat_map(|(set, measured)| {
            let bins = of(measured).bins().into_iter();
            bins.map(move |bin| {
                vec![
                    set.clone(),
                    format!("{:.2} to {:.2}", bin.from, bin.to),
                    format!("{:.3}", bin.said),
                    format!("{:.3}", bin.came),
                    format!("{:.3}", bin.sd),
                    bin.count.to_string(),
                ]
            })
        });
        let head = ["set", "probability", "said", "right", "sd", "count"];
        table(title, (2, &head), rows)
    }
}

/// A table under its title; none without a row. The first columns are to the left.
fn table(
    title: &str,
    (n_left, head): (usize, &[&str]),
    rows: impl Iterator<Item = Vec<String>>,
) -> Option<String> {
    let head = head.iter().map(|&name| name.to_owned()).collect();
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(rows).collect();
    (rows.len() > 1).then(|| format!("{title}\n{}", columns(n_left, &rows)))
}

fn told_row(set: &str, agent: &str, errors: &Errors) -> Vec<String> {
    vec![
        set.to_owned(),
        agent.to_owned(),
        metres(errors.dead_reckoning_aligned, 3),
        metres(errors.causal_aligned, 3),
        metres(errors.refined_aligned, 3),
    ]
}

fn session_row(set: &str, taught: usize, waking: &Waking) -> Vec<String> {
    vec![
        set.to_owned(),
        taught.to_string(),
        waking.woken.to_string(),
        waking.covered.to_string(),
        waking.covered_placed.to_string(),
        metres(waking.median_error_m, 2),
        waking.first_claims_over_15_m.to_string(),
        waking.claims_uncovered.to_string(),
        percent(waking.wrong_floor, 1),
    ]
}

fn route_row(set: &str, taught: &str, row: &SequenceRow) -> Vec<String> {
    vec![
        set.to_owned(),
        row.agent.clone(),
        taught.to_owned(),
        row.questions.to_string(),
        percent(Some(row.right), 1),
        row.claims.to_string(),
        percent(row.claims_right, 1),
    ]
}

fn position_row(set: &str, claims: &PositionClaims) -> Vec<String> {
    let shares = claims.coverage.shares();
    let start = claims.start.cell().to_owned();
    let mut row = vec![
        set.to_owned(),
        start,
        claims.agents.to_string(),
        claims.coverage.count().to_string(),
    ];
    row.extend((0..PROMISED.len()).map(|k| percent(shares.map(|all| all[k]), 1)));
    row
}

fn metres(value: Option<f64>, digits: usize) -> String {
    value.map_or("none".to_owned(), |value| format!("{value:.digits$}"))
}

fn percent(share: Option<f64>, digits: usize) -> String {
    share.map_or("none".to_owned(), |share| {
        format!("{:.digits$} %", 100.0 * share)
    })
}
