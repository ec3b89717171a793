//! The service's metrics.

use crate::http::Http;

/// Metrics at one moment.
#[derive(Clone, Debug)]
pub struct Metrics(String);

impl Metrics {
    /// Reads them from the service.
    pub fn read(http: &Http) -> Self {
        let answer = http.get("/metrics");
        assert_eq!(answer.status, 200, "{answer:?}");
        Self(answer.body)
    }

    /// Sum of a counter over all series that have every one of `labels`; zero where there is none.
    pub fn sum(&self, name: &str, labels: &[(&str, &str)]) -> u64 {
        let wanted: Vec<_> = labels.iter().map(|(k, v)| format!("{k}=\"{v}\"")).collect();
        self.0
            .lines()
            .filter(|line| line.split(['{', ' ']).next() == Some(name))
            .filter(|line| wanted.iter().all(|label| line.contains(label)))
            .filter_map(|line| line.rsplit(' ').next()?.parse::<u64>().ok())
            .sum()
    }
}
