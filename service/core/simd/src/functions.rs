//! Elementary functions of many numbers.
//!
//! A program has the same to the last bit on every machine of its kind, whatever the system's
//! library says.

use wide::f32x8;

use crate::dispatch;

/// Replaces numbers by their exponentials, to two units in the last place.
pub fn exp(numbers: &mut [f32]) {
    replace(numbers, f32x8::exp);
}

/// Replaces positive normal numbers by their natural logarithms, to two units in the last place.
pub fn ln(numbers: &mut [f32]) {
    replace(numbers, f32x8::ln);
}

/// Sines and cosines of angles of up to 1e4 \[rad\], to 1e-6.
pub fn sin_cos(angles: impl Iterator<Item = f32>) -> (Vec<f32>, Vec<f32>) {
    let mut sines: Vec<f32> = angles.collect();
    let mut cosines = sines.clone();
    dispatch(
        #[inline(always)]
        || {
            let cosines = cosines.chunks_mut(LANES);
            for (sines, cosines) in sines.chunks_mut(LANES).zip(cosines) {
                let (sin, cos) = read(sines).sin_cos();
                write(sin, sines);
                write(cos, cosines);
            }
        },
    );
    (sines, cosines)
}

const LANES: usize = 8;

#[expect(
    clippy::inline_always,
    reason = "compiled for the vectors of a dispatch"
)]
#[inline(always)]
fn replace(numbers: &mut [f32], function: impl Fn(f32x8) -> f32x8) {
    dispatch(
        #[inline(always)]
        || {
            for eight in numbers.chunks_mut(LANES) {
                write(function(read(eight)), eight);
            }
        },
    );
}

/// Up to eight numbers, and ones in place of those that are missing.
#[expect(
    clippy::inline_always,
    reason = "compiled for the vectors of a dispatch"
)]
#[inline(always)]
fn read(numbers: &[f32]) -> f32x8 {
    let mut eight = [1.0; LANES];
    eight[..numbers.len()].copy_from_slice(numbers);
    f32x8::from(eight)
}

#[expect(
    clippy::inline_always,
    reason = "compiled for the vectors of a dispatch"
)]
#[inline(always)]
fn write(eight: f32x8, numbers: &mut [f32]) {
    numbers.copy_from_slice(&eight.to_array()[..numbers.len()]);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers from `low` on, in steps that are no multiple of anything.
    fn numbers(low: f32, step: f32, count: u16) -> Vec<f32> {
        (0..count).map(|k| low + step * f32::from(k)).collect()
    }

    #[test]
    fn exponentials_and_logarithms_are_those_of_single_numbers() {
        let all = numbers(-110.0, 0.137, 1_400);
        for count in [0, 1, 7, 8, 9, all.len()] {
            let mut some = all[..count].to_vec();
            exp(&mut some);
            for (own, x) in some.iter().zip(&all) {
                let expected = f64::from(*x).exp();
                assert!(
                    (f64::from(*own) - expected).abs() <= 3e-7 * expected + 1e-37,
                    "{x}: {own}"
                );
            }
        }
        let mut edges = [f32::NEG_INFINITY, -1e30, 0.0, 1e30, f32::INFINITY, f32::NAN];
        exp(&mut edges);
        assert_eq!(edges[..5], [0.0, 0.0, 1.0, f32::INFINITY, f32::INFINITY]);
        assert!(edges[5].is_nan());
        let positive: Vec<f32> = all.iter().map(|x| (0.75 * x).exp()).collect();
        let mut logs = positive.clone();
        ln(&mut logs);
        for (own, x) in logs.iter().zip(&positive).filter(|(_, x)| x.is_normal()) {
            let expected = f64::from(*x).ln();
            assert!(
                (f64::from(*own) - expected).abs() <= 3e-7 * expected.abs() + 1e-7,
                "{x}: {own}"
            );
        }
    }

    #[test]
    fn sines_and_cosines_are_those_of_single_angles() {
        let angles = numbers(-40.0, 0.0631, 1_301);
        let (sines, cosines) = sin_cos(angles.iter().copied());
        for ((angle, sin), cos) in angles.iter().zip(sines).zip(cosines) {
            let (s, c) = f64::from(*angle).sin_cos();
            let off = [f64::from(sin) - s, f64::from(cos) - c];
            assert!(off.iter().all(|off| off.abs() < 1e-6), "{angle}: {off:?}");
        }
    }
}
