//! An object of coloured voxels and its surface.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::shape::{Voxel, solid, solid_of};

/// Edge of a voxel \[m\]: objects are as large as things that a hand takes.
pub const EDGE_M: f64 = 0.01;
/// Colours, as levels in equal steps from 0 to 1.
pub const COLOURS: usize = 8;
/// Voxels of one patch of colour, on average.
const PATCH_VOXELS: usize = 3;
/// The directions along the axes; two after another are opposite.
const DIRECTIONS: [Voxel; 6] = [
    Voxel::new(1, 0, 0),
    Voxel::new(-1, 0, 0),
    Voxel::new(0, 1, 0),
    Voxel::new(0, -1, 0),
    Voxel::new(0, 0, 1),
    Voxel::new(0, 0, -1),
];

/// A face of the surface: a free side of a voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// Its middle, in the object's own frame \[m\].
    pub position_m: Point3<f64>,
    /// Unit vector out of the solid, along an axis.
    pub normal: Vector3<f64>,
    /// The colour of its voxel, from 0 to 1.
    pub level: f64,
}

/// A way along the surface: a face, and the direction in which to leave it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heading {
    /// Number of the face.
    pub face: usize,
    /// Number of the direction, of those along the face.
    direction: usize,
}

/// A solid of voxels in one piece, whose surface is coloured in patches.
///
/// Shape and colours are functions of a seed and a number alone.
#[derive(Clone, Debug)]
pub struct VoxelObject {
    /// Voxel and direction of each face.
    sides: Vec<(Voxel, usize)>,
    faces: Vec<Face>,
    /// Numbers of the faces.
    numbers: BTreeMap<([i32; 3], usize), usize>,
    filled: BTreeSet<[i32; 3]>,
}

impl VoxelObject {
    /// The object of a number, among those of a seed.
    pub fn new(seed: u64, number: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number);
        let filled = solid(&mut random);
        Self::coloured(filled, &mut random)
    }

    /// The object of a number, put together from as many bodies as it takes for so many faces.
    pub fn with_faces(seed: u64, number: u64, faces: usize) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number);
        let mut bodies = 2;
        loop {
            let filled = solid_of(bodies, &mut random);
            let object = Self::coloured(filled, &mut random);
            if object.faces.len() >= faces {
                return object;
            }
            bodies += 1;
        }
    }

    fn coloured(filled: BTreeSet<[i32; 3]>, random: &mut ChaCha8Rng) -> Self {
        let is_free = |voxel: Voxel| !filled.contains(&<[i32; 3]>::from(voxel));
        let sides: Vec<(Voxel, usize)> = filled
            .iter()
            .map(|voxel| Voxel::from(*voxel))
            .flat_map(|voxel| (0..DIRECTIONS.len()).map(move |direction| (voxel, direction)))
            .filter(|(voxel, direction)| is_free(voxel + DIRECTIONS[*direction]))
            .collect();
        let levels = levels(&sides, random);
        let faces = sides.iter().map(|(voxel, direction)| {
            let normal = DIRECTIONS[*direction].cast::<f64>();
            Face {
                position_m: Point3::from((voxel.cast::<f64>() + normal / 2.0) * EDGE_M),
                normal,
                level: levels[&<[i32; 3]>::from(*voxel)],
            }
        });
        let numbers = sides
            .iter()
            .zip(0..)
            .map(|((voxel, direction), number)| (((*voxel).into(), *direction), number));
        Self {
            faces: faces.collect(),
            numbers: numbers.collect(),
            sides,
            filled,
        }
    }

    /// The faces of the surface.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// A random way off a face.
    pub fn random_heading(&self, face: usize, random: &mut ChaCha8Rng) -> Heading {
        let across = self.sides[face].1 / 2;
        let drawn = random.random_range(0..4);
        // The four directions that are not along the face's own axis.
        let direction = if drawn / 2 < across { drawn } else { drawn + 2 };
        Heading { face, direction }
    }

    /// Over the edge of a face straight onto the next one: around a convex edge, along a flat one,
    /// or up a wall.
    pub fn step(&self, heading: Heading) -> Heading {
        let (voxel, out) = self.sides[heading.face];
        let (along, up) = (DIRECTIONS[heading.direction], DIRECTIONS[out]);
        let is_filled = |voxel: Voxel| self.filled.contains(&<[i32; 3]>::from(voxel));
        let back = |direction: usize| direction ^ 1;
        let (voxel, side, direction) = if is_filled(voxel + along + up) {
            (voxel + along + up, back(heading.direction), out)
        } else if is_filled(voxel + along) {
            (voxel + along, out, heading.direction)
        } else {
            (voxel, heading.direction, back(out))
        };
        Heading {
            face: self.numbers[&(voxel.into(), side)],
            direction,
        }
    }
}

/// Levels of the voxels at the surface: each has that of the nearest of some drawn ones.
fn levels(sides: &[(Voxel, usize)], random: &mut ChaCha8Rng) -> BTreeMap<[i32; 3], f64> {
    let surface: BTreeSet<[i32; 3]> = sides.iter().map(|(voxel, _)| (*voxel).into()).collect();
    let surface: Vec<Voxel> = surface.into_iter().map(Voxel::from).collect();
    let patches = surface.len().div_ceil(PATCH_VOXELS);
    let middles: Vec<(Voxel, f64)> = (0..patches)
        .map(|_| {
            let middle = surface[random.random_range(0..surface.len())];
            let colour = random.random_range(0..COLOURS);
            (middle, colour as f64 / (COLOURS - 1) as f64)
        })
        .collect();
    let level = |voxel: &Voxel| {
        let nearest = middles
            .iter()
            .min_by_key(|(middle, _)| (middle - voxel).dot(&(middle - voxel)));
        nearest.map_or(0.0, |(_, level)| *level)
    };
    let all = surface.iter().map(|voxel| ((*voxel).into(), level(voxel)));
    all.collect()
}
