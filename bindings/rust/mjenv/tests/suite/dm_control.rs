//! Replays recordings of tasks of dm_control's suite, which the library loads from a plug-in beside it.

use std::fs;

use mjenv::{Env, Options};

use crate::golden::{folder, libm, real};

const SEED: u64 = 42;
const EPISODES: usize = 3;

/// A sum over the bits of all numbers; tests/golden/suite_episodes.py computes the same.
struct Checksum(u64);

impl Checksum {
    fn word(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x100_0000_01b3);
    }

    fn numbers(&mut self, numbers: &[f64]) {
        numbers.iter().for_each(|number| self.word(number.to_bits()));
    }
}

/// Plays the recorded episodes of a task. Returns how many steps they have, the return, and the checksum.
fn play(id: &str, norm: &str) -> (usize, f64, u64) {
    let mut options = Options::new(id).unwrap();
    options.set("norm", norm).unwrap().set("max_episode_steps", 50).unwrap();
    let mut env = Env::new(&options, 1).unwrap();
    let mut batch = env.batch::<f64>();
    let mut action = vec![0f32; env.action_space().count()];
    let (mut checksum, mut steps, mut total) = (Checksum(0xcbf2_9ce4_8422_2325), 0, 0.0);
    env.seed(.., &[SEED]).unwrap();
    env.seed_actions(SEED).unwrap();
    for _ in 0..EPISODES {
        env.reset(.., &mut batch).unwrap();
        checksum.numbers(batch.obs(0));
        loop {
            if !id.starts_with("dm_control/lqr") {
                env.sample_actions(&mut action).unwrap();
            }
            env.step(.., &action, &mut batch).unwrap();
            checksum.numbers(batch.obs(0));
            checksum.numbers(batch.reward());
            let (terminated, truncated) = (batch.terminated()[0], batch.truncated()[0]);
            checksum.word(terminated.into());
            checksum.word(truncated.into());
            total += batch.reward()[0];
            steps += 1;
            if terminated || truncated {
                break;
            }
        }
    }
    (steps, total, checksum.0)
}

#[test]
fn episodes_of_the_suite_are_those_of_dm_control() {
    let text = fs::read_to_string(folder().join(libm()).join("dm_control.txt")).unwrap();
    for id in ["dm_control/humanoid_CMU-walk-v0", "dm_control/lqr-lqr_6_2-v0"] {
        let line = text.lines().find(|line| line.split(' ').next() == Some(id)).unwrap();
        let words: Vec<_> = line.split(' ').collect();
        let (steps, total, checksum) = play(id, words[1]);
        assert_eq!(steps.to_string(), words[2], "{id}");
        assert_eq!(total.to_bits(), real(words[3]).to_bits(), "{id}");
        assert_eq!(format!("{checksum:016x}"), words[4], "{id}");
    }
}
