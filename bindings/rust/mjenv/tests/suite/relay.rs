//! A leg of tests/relay/run, which passes an episode on from language to language.

use std::fs;

use crate::golden::Golden;
use crate::replay::Replay;

/// MJENV_LEG: GOLDEN FIRST END IN OUT, as tests/relay/leg.c takes them.
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
