//! Nodes that come, freeze, end and are cut off, as one of them sees it.

use super::*;

const PATIENCE: Patience = Patience {
    beat: Duration::from_millis(500),
    lease: Duration::from_secs(5),
    settled: Duration::from_millis(500),
};
const SHARDS: u32 = 12;

fn node(name: &str) -> NodeId {
    NodeId {
        name: name.to_owned(),
        session: "1".to_owned(),
    }
}

fn view(me: &str) -> View {
    let shards = Shards::new(SHARDS).expect("a count");
    View::new(node(me), shards, PATIENCE)
}

/// A view of `a`, at a time that passes as it is told, of nodes that beat until they stop.
struct Scene {
    view: View,
    now: Instant,
    beating: BTreeSet<&'static str>,
    stopped: BTreeMap<&'static str, u32>,
    owners: Vec<OwnerRecord>,
    count: u32,
}

impl Scene {
    fn new() -> Self {
        Self {
            view: view("a"),
            now: Instant::now(),
            beating: BTreeSet::new(),
            stopped: BTreeMap::new(),
            owners: Vec::new(),
            count: 0,
        }
    }

    fn link(&mut self, name: &str) {
        self.view.link(node(name), true);
    }

    fn cut(&mut self, name: &str) {
        self.view.link(node(name), false);
    }

    fn stop(&mut self, name: &'static str) {
        self.beating.remove(name);
        self.stopped.insert(name, self.count);
    }

    fn owns(&mut self, shard: u32, name: &str, term: u64) {
        let (shard, node) = (ShardNumber(shard), node(name));
        self.owners.push(OwnerRecord { shard, term, node });
    }

    fn pass(&mut self, time: Duration) {
        let until = self.now + time;
        while self.now < until {
            self.now += Duration::from_millis(250);
            self.count += 1;
            let beating = self.beating.iter().map(|name| (*name, self.count));
            let stopped = self.stopped.iter().map(|(name, count)| (*name, *count));
            let nodes = beating.chain(stopped);
            let seen = Seen {
                nodes: nodes
                    .map(|(name, mark)| NodeRecord {
                        node: node(name),
                        address: format!("{name}:80"),
                        mark: mark.to_string(),
                    })
                    .collect(),
                owners: self.owners.clone(),
            };
            self.view.observe(seen, self.now, self.now);
            self.view.settle(self.now);
        }
    }

    fn wanted(&self) -> Option<usize> {
        self.view.wanted(self.now).map(|wanted| wanted.len())
    }

    fn is_free(&self, shard: u32) -> bool {
        self.view.is_free(ShardNumber(shard), self.now)
    }
}

fn seconds(time: f64) -> Duration {
    Duration::from_secs_f64(time)
}

#[test]
fn a_node_alone_has_all_once_it_has_looked_round() {
    let mut scene = Scene::new();
    assert!(!scene.view.in_contact(scene.now));
    scene.pass(seconds(0.25));
    assert!(scene.view.in_contact(scene.now));
    assert_eq!(scene.wanted(), None);
    scene.pass(seconds(0.5));
    assert_eq!(scene.wanted(), Some(SHARDS as usize));
    assert!(scene.is_free(0));
    let later = scene.now + seconds(5.0);
    assert!(!scene.view.in_contact(later));
}

#[test]
fn shards_of_a_live_node_are_its_own_until_it_has_lapsed() {
    let mut scene = Scene::new();
    scene.link("b");
    scene.beating.insert("b");
    scene.owns(3, "b", 7);
    scene.pass(seconds(2.0));
    let shared = scene.wanted().expect("nobody comes or goes");
    assert!((1..SHARDS as usize).contains(&shared));
    assert!(!scene.is_free(3) && scene.is_free(4));
    // Killed: its link goes at once, and its beats stop.
    scene.stop("b");
    scene.cut("b");
    scene.pass(seconds(1.0));
    assert!(!scene.is_free(3), "it may only be cut off");
    scene.pass(seconds(0.75));
    assert!(scene.is_free(3));
    assert_eq!(scene.wanted(), Some(SHARDS as usize));
}

#[test]
fn a_frozen_node_keeps_its_token_and_loses_its_part_after_the_lease() {
    let mut scene = Scene::new();
    scene.link("b");
    scene.beating.insert("b");
    scene.owns(3, "b", 7);
    scene.pass(seconds(2.0));
    scene.stop("b");
    scene.pass(seconds(4.5));
    assert!(!scene.is_free(3));
    scene.pass(seconds(1.0));
    assert!(scene.is_free(3));
    scene.pass(seconds(0.5));
    assert_eq!(scene.wanted(), Some(SHARDS as usize));
}

#[test]
fn the_smaller_side_of_a_cut_yields_and_the_larger_keeps_what_it_has() {
    let mut scene = Scene::new();
    for name in ["b", "c"] {
        scene.link(name);
        scene.beating.insert(name);
    }
    scene.owns(3, "b", 7);
    scene.pass(seconds(2.0));
    let before = scene.wanted().expect("nobody comes or goes");
    scene.cut("b");
    scene.pass(seconds(10.0));
    assert!(scene.wanted().expect("settled") >= before);
    assert!(!scene.is_free(3), "it has the storage");
    // Now this node is alone on its side.
    scene.cut("c");
    scene.pass(seconds(4.0));
    assert!(scene.wanted().expect("settled") > 0);
    scene.pass(seconds(2.0));
    assert_eq!(scene.wanted(), Some(0));
    scene.link("b");
    scene.link("c");
    scene.pass(seconds(1.0));
    assert_eq!(scene.wanted(), Some(before));
}

#[test]
fn of_a_team_in_three_parts_somebody_has_each_shard_again() {
    let mut had = BTreeSet::new();
    for me in ["a", "b", "c"] {
        let mut scene = Scene::new();
        scene.view = view(me);
        for name in ["a", "b", "c"].into_iter().filter(|name| *name != me) {
            scene.beating.insert(name);
        }
        scene.pass(seconds(8.0));
        assert_eq!(scene.wanted(), Some(0), "there may be a larger side");
        scene.pass(seconds(8.0));
        let wanted = scene.view.wanted(scene.now).expect("nobody comes or goes");
        assert!(wanted.iter().all(|shard| had.insert(*shard)), "one has it");
        // It keeps what it has taken, and leaves what others have.
        for shard in &wanted {
            scene.owns(shard.0, me, 8);
        }
        scene.pass(seconds(20.0));
        assert_eq!(scene.wanted(), Some(wanted.len()));
    }
    assert_eq!(had.len(), SHARDS as usize);
}

#[test]
fn of_two_equal_sides_that_with_the_first_node_stays() {
    let mut first = Scene::new();
    first.beating.insert("b");
    first.pass(seconds(8.0));
    assert_eq!(first.wanted(), Some(SHARDS as usize));
    let mut second = Scene::new();
    second.view = view("c");
    second.beating.insert("b");
    second.pass(seconds(8.0));
    assert_eq!(second.wanted(), Some(0));
}

#[test]
fn a_token_says_where_a_shard_is_and_takes_it_from_nobody() {
    let mut scene = Scene::new();
    for name in ["b", "c"] {
        scene.link(name);
        scene.beating.insert(name);
    }
    scene.owns(3, "b", 7);
    scene.pass(seconds(2.0));
    let owner = |shard, term, name| OwnerRecord {
        shard: ShardNumber(shard),
        term,
        node: node(name),
    };
    let known = |scene: &Scene| {
        let owner = scene.view.owner(ShardNumber(3), scene.now);
        owner.map(|owner| owner.term)
    };
    assert_eq!(known(&scene), Some(7));
    // Of the two only one is to own the shard now.
    scene.view.announce(owner(3, 8, "c"), true, scene.now);
    scene.view.announce(owner(3, 9, "a"), true, scene.now);
    scene.view.announce(owner(3, 10, "b"), true, scene.now);
    let expected = placement::owner(ShardNumber(3), &scene.view.live.nodes);
    let term = match expected.map(|node| &*node.name) {
        Some("a") => 9,
        Some("b") => 10,
        _ => 8,
    };
    assert_eq!(known(&scene), Some(term));
    assert_eq!(scene.view.recorded(ShardNumber(3)), Some(&owner(3, 7, "b")));
    assert!(!scene.is_free(3));
    for (term, name) in [(8, "c"), (9, "a"), (10, "b")] {
        scene.view.announce(owner(3, term, name), false, scene.now);
    }
    assert_eq!(known(&scene), Some(7));
    scene.view.announce(owner(4, 9, "b"), true, scene.now);
    assert!(scene.is_free(4));
}

#[test]
fn a_false_token_leads_nobody_astray_for_long() {
    let mut scene = Scene::new();
    scene.link("b");
    scene.beating.insert("b");
    scene.owns(3, "b", 7);
    // A node that has never been in the storage is none, whatever is said of it.
    scene.link("nobody");
    scene.pass(seconds(2.0));
    let shard = ShardNumber(3);
    let forged = |node, term| OwnerRecord { shard, term, node };
    scene
        .view
        .announce(forged(node("nobody"), u64::MAX), true, scene.now);
    let known = |scene: &Scene| scene.view.owner(shard, scene.now).map(|owner| owner.term);
    assert_eq!(known(&scene), Some(7));
    assert_eq!(scene.view.address(&node("nobody")), None);
    assert_eq!(scene.view.others(scene.now).len(), 1);
    // One in the name of a node that is there is believed until the storage must have told of it,
    // however often it is heard.
    let of_b = forged(node("b"), u64::MAX);
    for _ in 0..4 {
        scene.view.announce(of_b.clone(), true, scene.now);
        scene.pass(seconds(0.5));
    }
    assert_eq!(known(&scene), Some(7));
    // Tokens without number fill no memory.
    for term in 0..2 * TOKENS_MAX as u64 {
        scene
            .view
            .announce(forged(node("b"), term), true, scene.now);
    }
    assert_eq!(scene.view.announced.len(), TOKENS_MAX);
}

#[test]
fn after_a_standstill_of_the_storage_everybody_has_what_it_had() {
    let mut scene = Scene::new();
    scene.link("b");
    scene.beating.insert("b");
    scene.owns(3, "b", 7);
    scene.pass(seconds(2.0));
    // The other has resigned, as this one.
    scene.stop("b");
    scene.cut("b");
    scene.now += seconds(8.0);
    scene.view.settle(scene.now);
    assert!(!scene.view.in_contact(scene.now));
    scene.pass(seconds(0.25));
    assert!(scene.view.in_contact(scene.now) && !scene.is_free(3));
    scene.pass(seconds(1.0));
    assert!(!scene.is_free(3));
    scene.pass(seconds(0.5));
    assert!(scene.is_free(3), "it has not come back");
}

#[test]
fn what_the_dead_have_left_is_found_late() {
    let mut scene = Scene::new();
    scene.beating.insert("b");
    scene.pass(seconds(1.0));
    scene.stop("b");
    scene.pass(seconds(50.0));
    assert_eq!(scene.view.left_behind(scene.now), []);
    scene.pass(seconds(12.0));
    assert_eq!(
        scene.view.left_behind(scene.now),
        [(node("b"), "b:80".to_owned())]
    );
}
