//! Plays a part of an episode for tests/relay/run, which passes it from one language to the next.

use std::fs;

use crate::golden::Golden;
use crate::replay::Replay;

/// The variable MJENV_LEG holds GOLDEN FIRST END IN OUT, the arguments of tests/relay/leg.c.
#[test]
#[ignore = "run by tests/relay/run"]
fn leg() {
    let words = std::env::var("MJENV_LEG").unwrap();
    let words: Vec<_> = words.split(' ').collect();
    let golden = Golden::all("trajectories", words[0]).remove(0);
    let (first, end): (usize, usize) = (words[1].parse().unwrap(), words[2].parse().unwrap());
    let mut replay = Replay::new(&golden, 3, 2);
    if first > 0 {
        replay.env.restore(2, &fs::read(words[3]).unwrap()).unwrap();
    }
    (first..end).for_each(|step| replay.step(step));
    fs::write(words[4], replay.env.snapshot(2).unwrap()).unwrap();
}
