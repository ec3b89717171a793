//! A surface that goes on: where the next contact lies, by the contacts before alone.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector3};

use crate::contact::Contact;
use crate::library::ObjectLibrary;
use crate::tuning::{CONTINUED_MIN, CONTINUED_NEAREST, FIELD_PER_SPACING};

/// What goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Curve,
    Surface,
}

/// Log density of a contact \[1/m³\] with an object of which nothing is known but the contacts
/// before, per that of a walk's step on a typical object of the library. It lies anywhere within
/// `reach_m` along what these lie on: a curve, if most objects of the library are curves. `None`
/// before there are enough contacts, and if no object of the library gains by the contact before as
/// well: see [`SharedError`](super::shared_error::SharedError).
pub(super) fn continued_log(
    library: &ObjectLibrary,
    before: &[Contact],
    contact: &Contact,
    reach_m: f64,
) -> Option<f64> {
    let count = library.len().max(1) as f64;
    let (mut shares, mut extents_m, mut spacings_m, mut curves) = (0.0, 0.0, 0.0, 0.0);
    let mut shared = false;
    for (_, indexed) in library.likelier_models() {
        shares += indexed.share(reach_m).max(1e-9).ln();
        extents_m += indexed.extent_m;
        spacings_m += indexed.spacing_m;
        curves += f64::from(indexed.is_curve);
        shared |= indexed.shares_errors();
    }
    if !shared {
        return None;
    }
    let form = if 2.0 * curves > count {
        Form::Curve
    } else {
        Form::Surface
    };
    let sizes = Sizes {
        reach_m,
        extent_m: extents_m / count,
        spacing_m: spacings_m / count,
    };
    let log = goes_on_log(before, contact, form, sizes)?;
    Some(log + shares / count)
}

/// Lengths that are typical of a walk and of the objects of a library \[m\].
#[derive(Clone, Copy, Debug)]
#[expect(clippy::struct_field_names, reason = "their unit")]
struct Sizes {
    reach_m: f64,
    extent_m: f64,
    /// Nothing finer is told apart.
    spacing_m: f64,
}

/// Log density of a contact on a form that goes on \[1/m³\].
///
/// The line or plane of least squares through the nearest of them has slopes with a prior deviation
/// of one, which count as far as contacts beside one another leave them open (Bayesian linear
/// regression). An object of the size `extent_m` leaves its tangent by about d²/extent at the
/// distance d.
fn goes_on_log(before: &[Contact], contact: &Contact, form: Form, sizes: Sizes) -> Option<f64> {
    let field_m = FIELD_PER_SPACING * sizes.spacing_m.max(f64::MIN_POSITIVE.sqrt());
    let noise_m2 = |own: &Contact| {
        let drift_m2 = contact.drift_sd_m.powi(2) - own.drift_sd_m.powi(2);
        field_m * field_m + own.position_sd_m.powi(2) + drift_m2.max(0.0)
    };
    let apart = |own: &Contact| own.position_m - contact.position_m;
    let mut near: Vec<&Contact> = before.iter().collect();
    if near.len() < CONTINUED_MIN {
        return None;
    }
    let squares = |own: &&Contact| apart(own).norm_squared();
    near.sort_by(|a, b| squares(a).total_cmp(&squares(b)));
    near.truncate(CONTINUED_NEAREST);
    let bend_m2 = |square: f64| (square / sizes.extent_m.max(field_m)).powi(2);
    let weighted = near.iter().map(|own| {
        let at = apart(own);
        (at, 1.0 / (noise_m2(own) + bend_m2(at.norm_squared())))
    });
    let weight: f64 = weighted.clone().map(|(_, weight)| weight).sum();
    let middle = weighted.clone().map(|(at, weight)| at * weight);
    let middle = middle.sum::<Vector3<f64>>() / weight;
    let spread = weighted.map(|(at, weight)| {
        let offset = at - middle;
        offset * offset.transpose() * weight
    });
    let eigen = spread.sum::<Matrix3<f64>>().symmetric_eigen();
    let mut axes: Vec<(f64, f64)> = { eigen.eigenvalues.iter() }
        .zip(eigen.eigenvectors.column_iter())
        .map(|(value, axis)| (value.max(0.0), axis.dot(&middle)))
        .collect();
    axes.sort_by(|a, b| b.0.total_cmp(&a.0));
    let along = match form {
        Form::Curve => 1,
        Form::Surface => 2,
    };
    // The contact lies at the origin, the middle of the others at these offsets from it.
    let (tangents, normals) = axes.split_at(along);
    let open = { tangents.iter() }.map(|(value, offset_m)| offset_m * offset_m / (1.0 + value));
    let variance_m2 =
        noise_m2(contact) + 1.0 / weight + open.sum::<f64>() + bend_m2(squares(&near[0]));
    let across = { normals.iter() }
        .map(|(_, offset_m)| -0.5 * (offset_m * offset_m / variance_m2 + (TAU * variance_m2).ln()));
    // A walk that stays where it is is on a place all the same.
    let reach_m = sizes.reach_m.hypot(sizes.spacing_m).max(field_m);
    let room = match form {
        Form::Curve => 2.0 * reach_m,
        Form::Surface => PI * reach_m * reach_m,
    };
    Some(across.sum::<f64>() - room.ln())
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, UnitQuaternion};

    use super::*;

    const SIZES: Sizes = Sizes {
        reach_m: 0.02,
        extent_m: 0.12,
        spacing_m: 0.004,
    };

    fn contact(x: f64, y: f64, z: f64) -> Contact {
        Contact::at(Point3::new(x, y, z), 0.001)
    }

    /// Contacts with a plane, about its middle.
    fn plane() -> Vec<Contact> {
        let around = [(-0.01, -0.008), (-0.008, 0.01), (0.01, 0.0), (0.003, -0.01)];
        around.map(|(x, y)| contact(x, y, 0.0)).into()
    }

    fn log(before: &[Contact], contact: &Contact, form: Form) -> f64 {
        goes_on_log(before, contact, form, SIZES).expect("enough contacts")
    }

    #[test]
    fn the_next_contact_lies_somewhere_along_the_surface() {
        // Over all depths, and over all of the disc, the probability is one.
        let step_m = 1e-5;
        let depths = (-2000..=2000).map(|k| {
            log(
                &plane(),
                &contact(0.0, 0.0, step_m * f64::from(k)),
                Form::Surface,
            )
            .exp()
        });
        let across = depths.sum::<f64>() * step_m * PI * (0.02_f64.powi(2) + 0.004_f64.powi(2));
        // The contacts before count a little less the farther away it is.
        assert!((across - 1.0).abs() < 0.05, "{across}");
    }

    #[test]
    fn it_is_the_same_however_the_object_lies() {
        let turn = UnitQuaternion::from_euler_angles(0.7, -1.1, 2.3);
        let moved = |own: &Contact| {
            let at = turn * own.position_m + Vector3::new(3.0, -2.0, 1.0);
            Contact::at(at, own.position_sd_m)
        };
        let next = contact(0.012, 0.007, 0.002);
        let before: Vec<Contact> = plane().iter().map(moved).collect();
        for form in [Form::Surface, Form::Curve] {
            let still = log(&plane(), &next, form);
            let turned = log(&before, &moved(&next), form);
            assert!((still - turned).abs() < 1e-6, "{form:?}: {still} {turned}");
        }
    }

    #[test]
    fn contacts_along_a_line_leave_the_surface_open_about_it() {
        let line: Vec<Contact> = (0..4)
            .map(|k| contact(0.005 * f64::from(k), 0.0, 0.0))
            .collect();
        // A step to the side may go any way about the line; of a curve it is none.
        let [up, aside] = [(0.0, 0.01), (0.01, 0.0)].map(|(y, z)| contact(0.012, y, z));
        let [up, aside] = [up, aside].map(|next| log(&line, &next, Form::Surface));
        assert!(f64::max(up, aside) > log(&plane(), &contact(0.0, 0.0, 0.005), Form::Surface));
        assert!(log(&line, &contact(0.012, 0.01, 0.0), Form::Curve) < f64::max(up, aside) - 5.0);
        assert!(log(&line, &contact(0.018, 0.0, 0.0), Form::Curve) > 10.0);
    }

    #[test]
    fn two_contacts_span_nothing() {
        let two = &plane()[..2];
        let next = contact(0.0, 0.0, 0.0);
        assert_eq!(goes_on_log(two, &next, Form::Surface, SIZES), None);
        // Contacts at one point are no reason to fail.
        let same = [(); 4].map(|()| contact(0.0, 0.0, 0.0));
        assert!(log(&same, &next, Form::Surface).is_finite());
        assert!(log(&same, &contact(0.01, 0.0, 0.0), Form::Surface).is_finite());
        // Nor is a hand that says it is exact, and rests.
        let exact = [(); 4].map(|()| Contact::at(Point3::origin(), 0.0));
        let still = Sizes {
            reach_m: 0.0,
            ..SIZES
        };
        for form in [Form::Surface, Form::Curve] {
            let log = goes_on_log(&exact, &exact[0], form, still).expect("enough contacts");
            // No denser than what a place is.
            assert!(
                log < -2.0 * (0.1 * SIZES.spacing_m).ln() - 3.0 * 1e-3_f64.ln(),
                "{log}"
            );
            assert!(log.is_finite());
        }
    }
}
