//! Plays three seeded episodes of each id.
//!
//!     episodes [--norm plain|fused] ID...
//!
//! Prints ID, steps, return, steps per second and a checksum over every bit of every output, separated by tabs.

use std::env;
use std::process::ExitCode;
use std::time::Instant;

use mjenv::{Env, Error, Options};

const EPISODES: usize = 3;
const SEED: u64 = 42;

struct Checksum(u64);

impl Checksum {
    fn word(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x0100_0000_01b3);
    }

    fn numbers(&mut self, numbers: &[f64]) {
        numbers.iter().for_each(|number| self.word(number.to_bits()));
    }
}

fn play(id: &str, norm: &str) -> Result<(), Error> {
    let mut options = Options::new(id)?;
    let mut env = Env::new(options.set("norm", norm)?, 1)?;
    let mut batch = env.batch::<f64>();
    let mut action = vec![0.0f32; env.action_space().count()];
    let (mut checksum, mut steps, mut total) = (Checksum(0xcbf2_9ce4_8422_2325), 0, 0.0);

    let start = Instant::now();
    env.seed(.., &[SEED])?;
    env.seed_actions(SEED)?;
    for episode in 1..=EPISODES {
        eprintln!("{id}: episode {episode} of {EPISODES}");
        env.reset(.., &mut batch)?;
        checksum.numbers(batch.obs(0));
        batch.reset_infos().for_each(|(_, values)| checksum.numbers(values));
        while !batch.ended(0) {
            env.sample_actions(&mut action)?;
            env.step(.., &action, &mut batch)?;
            checksum.numbers(batch.obs(0));
            checksum.numbers(batch.reward());
            checksum.word(batch.terminated()[0].into());
            checksum.word(batch.truncated()[0].into());
            batch.infos().for_each(|(_, values)| checksum.numbers(values));
            total += batch.reward()[0];
            steps += 1;
        }
    }
    let rate = f64::from(steps) / start.elapsed().as_secs_f64();
    println!("{id}\t{steps}\t{total}\t{rate:.0}\t{:016x}", checksum.0);
    Ok(())
}

fn main() -> ExitCode {
    let mut arguments: Vec<_> = env::args().skip(1).collect();
    let mut norm = "auto".to_string();
    if arguments.len() > 1 && arguments[0] == "--norm" {
        norm = arguments.drain(..2).nth(1).unwrap_or_default();
    }
    if arguments.is_empty() || arguments[0].starts_with('-') {
        eprintln!("usage: episodes [--norm plain|fused] ID...");
        return ExitCode::from(2);
    }
    for id in &arguments {
        if let Err(error) = play(id, &norm) {
            eprintln!("{id}: {error}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}
