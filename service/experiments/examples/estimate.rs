//! scratch
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;
use cognitive_map::estimation::{Estimator, Parameters};
use cognitive_map::*;
use cogmap_experiments::metrics::*;
use cogmap_experiments::mrclam::Mrclam;

fn env(name: &str, v: f64) -> f64 { std::env::var(name).ok().and_then(|x| x.parse().ok()).unwrap_or(v) }
fn params() -> Parameters {
    let d = Parameters::default();
    Parameters {
        length_error_sd: env("LEN", d.length_error_sd), angle_error_sd: env("ANG", d.angle_error_sd), bias_sd_rad_s: env("BIAS", d.bias_sd_rad_s),
        calibration_renewal: env("RENEW", d.calibration_renewal), translation_sd_per_sqrt_m: env("TM", d.translation_sd_per_sqrt_m),
        rotation_sd_per_sqrt_m: env("RM", d.rotation_sd_per_sqrt_m), rotation_sd_per_sqrt_rad: env("RR", d.rotation_sd_per_sqrt_rad),
        soft: env("SOFT", d.soft), gate: env("GATE", d.gate), lasting_range_error: env("RE", d.lasting_range_error),
    }
}
struct Out { mean: f64, aligned: f64, robots: Vec<f64>, nees: f64, nis: f64, refused: u64, accepted: u64, took: f64, worst: f64, p99: f64 }
fn run(set: &Mrclam, start_s: f64, length_s: f64, verbose: bool) -> Out {
    let mut e = Estimator::new(params());
    let robots: Vec<u32> = set.robots().keys().copied().collect();
    let id: BTreeMap<u32, u32> = robots.iter().map(|&r| (r, e.enrol())).collect();
    let by_name: BTreeMap<String, u32> = robots.iter().map(|&r| (format!("robot{r}"), id[&r])).collect();
    let mut tr: BTreeMap<u32, Vec<StampedPose>> = BTreeMap::new();
    let norobots = env("NOROB", 0.0) > 0.0;
    let mut span = set.span();
    span.start_ns += (start_s * 1e9) as i64;
    span.end_ns = span.end_ns.min(span.start_ns.saturating_add((length_s * 1e9) as i64));
    let readings: Vec<(u32, Sample)> = set.team_readings().into_iter().map(|r| (r.robot, Sample::try_from(&r.reading).unwrap())).filter(|(_, s)| s.stamp_ns >= span.start_ns && s.stamp_ns <= span.end_ns && !matches!(s.body, SampleBody::StartPose(_))).collect();
    let truth = set.robots();
    let (mut nees, mut nn, mut last) = (0.0, 0u64, BTreeMap::new());
    let mut times = Vec::new();
    let unknown = env("UNK", 0.0) > 0.0;
    let mut since: BTreeMap<u32, i64> = BTreeMap::new();
    for &r in &robots {
        let sp = truth[&r].truth_at(span.start_ns).unwrap().in_space();
        let q = sp.pose.rotation.coords;
        if unknown && r != robots[0] { tr.entry(r).or_default(); continue; }
        e.start_pose(id[&r], &StartPose::new(sp.pose.translation.vector.into(), [q.x, q.y, q.z, q.w], PoseNoise::none()).unwrap());
        tr.entry(r).or_default().push(sp);
    }
    for (robot, sample) in &readings {
        let a = id[robot];
        let t = Instant::now();
        match &sample.body {
            SampleBody::Motion(m) => { e.motion(a, sample.stamp_ns, m); }
            SampleBody::Sighting(s) => match &s.target {
                Target::Landmark(l) => { e.landmark(a, sample.stamp_ns, l, &s.relation); }
                Target::Agent(n) => if !norobots { e.sighting(a, sample.stamp_ns, by_name[n.as_str()], &s.relation) },
                Target::OwnSample(_) => {}
            },
            _ => {}
        }
        times.push(t.elapsed().as_secs_f64());
        let (pose, cov) = e.pose(a).unwrap();
        if unknown && !e.is_in_map(a) { continue; }
        since.entry(*robot).or_insert(sample.stamp_ns);
        let v = tr.entry(*robot).or_default();
        let sp = StampedPose { stamp_ns: sample.stamp_ns, pose };
        if v.last().is_some_and(|l: &StampedPose| l.stamp_ns == sample.stamp_ns) { *v.last_mut().unwrap() = sp } else { v.push(sp) }
        let due = last.get(robot).is_none_or(|&l| sample.stamp_ns - l > 1_000_000_000);
        if due && let Some(g) = truth[robot].truth_at(sample.stamp_ns) {
            last.insert(*robot, sample.stamp_ns);
            let err: nalgebra::Vector3<f64> = pose.rotation.inverse() * (nalgebra::Vector3::new(g.x_m, g.y_m, 0.0) - pose.translation.vector);
            let c = cov.matrix().fixed_view::<2, 2>(0, 0).into_owned();
            if let Some(i) = c.try_inverse() { let x = err.fixed_rows::<2>(0).into_owned(); nees += x.dot(&(i * x)).min(100.0); nn += 1; }
        }
    }
    let n = robots.len() as f64;
    if unknown && verbose { for (r, t) in &since { println!("robot {r} in map after {:.1} s", (t - span.start_ns) as f64 * 1e-9); } }
    let full = span; let mut span = span; if env("LATE", 0.0) > 0.0 { span.start_ns = full.start_ns + 60_000_000_000; }
    let mut out = Out { mean: 0.0, aligned: 0.0, robots: vec![], nees: nees / nn as f64 / 2.0, nis: 0.0, refused: 0, accepted: 0, took: times.iter().sum(), worst: 0.0, p99: 0.0 };
    for (&r, log) in set.robots() {
        let est = Trajectory::from_poses(&tr[&r]).unwrap();
        let truth = log.truth_trajectory();
        let x = ate_rmse_m(&est, &truth, span, Alignment::None).unwrap();
        out.mean += x / n; out.robots.push(x);
        out.aligned += ate_rmse_m(&est, &truth, span, Alignment::Planar).unwrap() / n;
        if verbose { println!("{r} {:?}", e.evidence(id[&r])); }
    }
    if env("V", 0.0) > 1.0 {
        for (l, p, c) in e.landmarks() { let n: u32 = l.as_str()[9..].parse().unwrap(); let g = set.landmarks()[&n]; println!("{} err {:.3} {:.3} sd {:.3} {:.3}", l.as_str(), p[0]-g[0], p[1]-g[1], c[(0, 0)].sqrt(), c[(1, 1)].sqrt()); }
    }
    let (mut nis, mut comps) = (0.0, 0);
    for &a in id.values() { let v = e.evidence(a).unwrap(); nis += v.nis; comps += v.components; out.refused += v.refused; out.accepted += v.accepted; }
    out.nis = nis / comps as f64;
    times.sort_by(f64::total_cmp);
    out.worst = times[times.len() - 1]; out.p99 = times[times.len() * 99 / 100];
    out
}

fn room(seed: u64, persistent: bool, steps: u64, reach: f64) -> (f64, f64, f64, f64) {
    use cogmap_experiments::world::*; use cogmap_experiments::reading::*;
    use rand::{SeedableRng, RngExt}; use rand_distr::StandardNormal;
    let world = ObstacleWorld::new(seed);
    let stream = |n| { let mut r = rand_chacha::ChaCha8Rng::seed_from_u64(seed); r.set_stream(n); r };
    let c = world.centre_m();
    let mut pure = PureWalker::new(&world, c, stream(1)).unwrap();
    let mut walk = Walker::new(&world, c, stream(1)).unwrap();
    let noise = OdometryNoise { translation_share: env("OT", 0.05), scale_bias: env("OS", 0.01), rotation_sd_rad: env("OR", 0.5f64).to_radians(), gyro_bias_rad: env("OB", 0.02f64).to_radians() };
    let mut odo = Odometer::new(noise, stream(2)).unwrap();
    let mut eyes = stream(3);
    let mut e = Estimator::new(params());
    let a = e.enrol();
    let pose0 = if persistent { *walk.pose() } else { pure.pose() };
    let q = pose0.rotation.coords;
    e.start_pose(a, &StartPose::new(pose0.translation.vector.into(), [q.x, q.y, q.z, q.w], PoseNoise::none()).unwrap());
    let (mut sum, mut early, mut nees, mut nn) = (0.0, 0.0, 0.0, 0u32);
    let mut reck = pose0; let mut dr = 0.0;
    for k in (if env("ZERO", 0.0) > 0.0 { 0 } else { 1 })..=steps {
        if k > 0 { let step = if persistent { walk.step(&world) } else { pure.step(&world) };
        let stamp = k as i64 * 100_000_000;
        let reading = odo.read(&step, stamp, 0.1);
        let SampleBody::Motion(m) = Sample::try_from(&reading).unwrap().body else { panic!() };
        e.motion(a, stamp, &m); reck *= m.increment(); }
        let stamp = k as i64 * 100_000_000;
        let pose = if persistent { *walk.pose() } else { pure.pose() };
        if k % 5 == 0 {
            for (n, cube) in (1..).zip(world.cubes()) {
                let line = cube.centre_m - pose.translation.vector;
                let r = line.norm();
                if r > reach { continue; }
                let d = pose.rotation.inverse() * line;
                let mut g = |s: f64| s * eyes.sample::<f64, _>(StandardNormal);
                let (rs, bs) = (0.05 * r, 1f64.to_radians());
                let rng = (r + g(rs)).max(0.0); let az = d.y.atan2(d.x) + g(bs); let el = d.z.atan2(d.x.hypot(d.y)) + g(bs);
                let l = Label::new(&format!("cube-{n:02}")).unwrap();
                e.landmark(a, stamp, &l, &Relation::RangeBearing(RangeBearing::new(rng, az, el, rs, bs).unwrap()));
            }
        }
        let (est, cov) = e.pose(a).unwrap();
        let err = (est.translation.vector - pose.translation.vector).norm_squared();
        dr += (reck.translation.vector - pose.translation.vector).norm_squared(); sum += err; if k <= 1000 { early += err; }
        if k % 50 == 0 {
            let (l, r) = cognitive_map::geometry::se3::log(&est.inv_mul(&pose));
            let x = nalgebra::Vector6::new(l.x, l.y, l.z, r.x, r.y, r.z);
            if let Some(i) = cov.matrix().try_inverse() { nees += x.dot(&(i * x)) / 6.0; nn += 1; if env("V", 0.0) > 2.0 { let z: Vec<String> = (0..6).map(|j| format!("{:.3}/{:.3}", x[j], cov.matrix()[(j, j)].sqrt())).collect(); println!("{k} nees {:.2} {}", x.dot(&(i * x)) / 6.0, z.join(" ")); } }
        }
    }
    ((sum / steps as f64).sqrt(), (early / steps.min(1000) as f64).sqrt(), nees / f64::from(nn), (dr / steps as f64).sqrt())
}
fn rooms(name: &str, persistent: bool, steps: u64, seeds: u64, reach: f64) {
    let t = Instant::now();
    let outs: Vec<_> = std::thread::scope(|s| { let h: Vec<_> = (0..2u64).map(|c| s.spawn(move || (1..=seeds).filter(|k| k % 2 == c).map(|k| room(k, persistent, steps, reach)).collect::<Vec<_>>())).collect(); h.into_iter().flat_map(|h| h.join().unwrap()).collect() });
    let mut all: Vec<f64> = outs.iter().map(|o| o.0).collect(); all.sort_by(f64::total_cmp);
    let mut ratio: Vec<f64> = outs.iter().map(|o| o.0 / o.1).collect(); ratio.sort_by(f64::total_cmp);
    let n = all.len();
    println!("{name} median {:.4} worst {:.4} ratio {:.3} nees {:.2} dr {:.3} {:.1}s", 0.5 * (all[(n - 1) / 2] + all[n / 2]), all[n - 1], ratio[n / 2], outs.iter().map(|o| o.2).sum::<f64>() / n as f64, outs.iter().map(|o| o.3).sum::<f64>() / n as f64, t.elapsed().as_secs_f64());
}
fn main() {
    if env("ROOM", 0.0) > 0.0 {
        let seeds = env("SEEDS", 20.0) as u64;
        rooms("persistent", true, 1000, seeds, 8.0);
        if env("PURE", 1.0) > 0.0 { rooms("pure", false, 1000, seeds, 8.0); }
        if env("ROOM", 0.0) > 1.0 { rooms("persistent 4 m", true, 1000, 20, 4.0); rooms("long", true, 20000, 4, 8.0); }
        return;
    }
    let dir = std::env::args().nth(1).unwrap_or("/tmp/data/mrclam/MRCLAM_Dataset6".into());
    let set = Mrclam::load(Path::new(&dir)).unwrap();
    let o = run(&set, 0.0, 1e6, env("V", 0.0) > 0.0);
    let robots: Vec<String> = o.robots.iter().map(|x| format!("{x:.3}")).collect();
    print!("ALL {:.4}/{:.4} [{}] nees {:.2} nis {:.2} ref {}/{} {:.2}s p99 {:.0}us max {:.1}ms", o.mean, o.aligned, robots.join(" "), o.nees, o.nis, o.refused, o.accepted, o.took, o.p99 * 1e6, o.worst * 1e3);
    if env("MULTI", 1.0) > 0.0 {
        let starts = [40.0, 90.0, 140.0, 190.0, 240.0, 290.0, 340.0, 390.0];
        let set = &set;
        let outs: Vec<Out> = std::thread::scope(|s| { let h: Vec<_> = starts.chunks(4).map(|c| s.spawn(move || c.iter().map(|&x| run(set, x, 360.0, false)).collect::<Vec<_>>())).collect(); h.into_iter().flat_map(|h| h.join().unwrap()).collect() });
        let n = outs.len() as f64;
        let each: Vec<String> = outs.iter().map(|o| format!("{:.3}", o.mean)).collect();
        let worst = outs.iter().flat_map(|o| &o.robots).fold(0.0f64, |a, &b| a.max(b));
        print!(" || MULTI {:.4}/{:.4} nees {:.2} worst {worst:.3} [{}]", outs.iter().map(|o| o.mean).sum::<f64>() / n, outs.iter().map(|o| o.aligned).sum::<f64>() / n, outs.iter().map(|o| o.nees).sum::<f64>() / n, each.join(" "));
    }
    println!();
}
