//! Which of some places is nearest to a point.

use nalgebra::Point3;

/// Places of a leaf, at most: so many are compared one by one.
const LEAF: usize = 8;

/// Places in the order of a k-d tree (Bentley 1975): the middle place of a slice divides it along
/// its longest axis, those below come before it and those above behind it.
#[derive(Clone, Debug)]
pub(crate) struct NearestPlace {
    /// Positions and numbers.
    places: Vec<(Point3<f64>, u32)>,
    /// Axis along which the place of the same index divides its slice.
    axes: Vec<u8>,
}

impl NearestPlace {
    /// Of places at these positions.
    pub(crate) fn new(positions: &[Point3<f64>]) -> Self {
        let mut places: Vec<_> = positions.iter().copied().zip(0..).collect();
        let mut axes = vec![0; places.len()];
        divide(&mut places, &mut axes);
        Self { places, axes }
    }

    /// The nearest place to a point: squared distance \[m²\] and number, the lower one of two that
    /// are equally near.
    pub(crate) fn find(&self, point: &Point3<f64>) -> Option<(f64, u32)> {
        let mut best = None;
        search(&self.places, &self.axes, point, &mut best);
        best
    }
}

/// Puts places into the order of the tree.
fn divide(places: &mut [(Point3<f64>, u32)], axes: &mut [u8]) {
    if places.len() <= LEAF {
        return;
    }
    let middle = places.len() / 2;
    let width = |axis: &usize| {
        let at = places.iter().map(|(position, _)| position[*axis]);
        let (low, high) = at.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        high - low
    };
    let axis = (0..3).max_by(|a, b| width(a).total_cmp(&width(b)));
    let axis = axis.unwrap_or_default();
    places.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]));
    axes[middle] = u8::try_from(axis).unwrap_or_default();
    let (below, above) = places.split_at_mut(middle);
    let (axes_below, axes_above) = axes.split_at_mut(middle);
    divide(below, axes_below);
    divide(&mut above[1..], &mut axes_above[1..]);
}

/// Looks for a place that is nearer than the best so far.
fn search(
    places: &[(Point3<f64>, u32)],
    axes: &[u8],
    point: &Point3<f64>,
    best: &mut Option<(f64, u32)>,
) {
    let mut compare = |&(position, number): &(Point3<f64>, u32)| {
        let square = (position - point).norm_squared();
        let is_nearer = best
            .is_none_or(|(least, other)| square.total_cmp(&least).then(number.cmp(&other)).is_lt());
        if is_nearer {
            *best = Some((square, number));
        }
    };
    if places.len() <= LEAF {
        places.iter().for_each(compare);
        return;
    }
    let middle = places.len() / 2;
    compare(&places[middle]);
    let axis = usize::from(axes[middle]);
    let apart = places[middle].0[axis] - point[axis];
    let (below, above) = (
        (&places[..middle], &axes[..middle]),
        (&places[middle + 1..], &axes[middle + 1..]),
    );
    let (near, far) = if apart > 0.0 {
        (below, above)
    } else {
        (above, below)
    };
    search(near.0, near.1, point, best);
    // What lies behind the plane is not nearer than the plane. The negated condition also searches
    // where a coordinate is no number.
    if !best.is_some_and(|(least, _)| apart * apart > least) {
        search(far.0, far.1, point, best);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_one_that_all_others_are_farther_than() {
        let noise = |k: u64| random::uniform(9, [0, 0, k]) * 0.2 - 0.1;
        let point = |k: u64| Point3::new(noise(3 * k), noise(3 * k + 1), noise(3 * k + 2));
        let mut positions: Vec<Point3<f64>> = (0..300).map(point).collect();
        positions.extend_from_within(..100);
        for count in [1, LEAF, LEAF + 1, 51, positions.len()] {
            let positions = &positions[..count];
            let nearest = NearestPlace::new(positions);
            for (k, scale) in (1000..1200).zip([0.5, 1.0, 2.0, 100.0].into_iter().cycle()) {
                let query = Point3::from(point(k).coords * scale);
                let (square, number) = nearest.find(&query).unwrap();
                assert!(number < 300);
                let squares = { positions.iter() }.map(|other| (other - query).norm_squared());
                let least = squares.clone().fold(f64::INFINITY, f64::min);
                let found = squares.clone().nth(number as usize);
                assert_eq!([Some(square), found], [Some(least); 2]);
            }
            for (number, position) in (0..300).zip(positions) {
                assert_eq!(nearest.find(position), Some((0.0, number)));
            }
        }
        let nearest = NearestPlace::new(&positions);
        assert_eq!(nearest.find(&positions[350]), Some((0.0, 50)));
        assert_eq!(NearestPlace::new(&[]).find(&Point3::origin()), None);
    }
}
