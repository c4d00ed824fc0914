//! Tests automatic resets, rollouts and copies of rows.

use mjenv::{Batch, Env, Lanes, Options};

use crate::golden::{assert_bits, Actions, Golden};
use crate::replay::{check_infos, check_step, Recording, Replay};

const IDS: [&str; 4] = ["Ant-v5", "Hopper-v5", "Reacher-v4", "Walker2d-v5"];

/// Two equal rows that reset themselves, and the recording that they must follow.
struct Pair {
    golden: Golden,
    recording: Recording,
    actions: Vec<f32>,
    env: Env,
    batch: Batch,
}

impl Pair {
    fn new(id: &str, autoreset_mode: &str) -> Self {
        let golden = Golden::of(id);
        let mut options = golden.options();
        options.set("autoreset_mode", autoreset_mode).unwrap().set("num_threads", 2).unwrap();
        let mut env = Env::new(&options, 2).unwrap();
        let mut batch = env.batch();
        env.seed(&[golden.seed; 2]).unwrap();
        env.reset(&mut batch).unwrap();
        let actions = match golden.actions() {
            Actions::Float32(actions) => actions,
            Actions::Float64(_) => panic!("{} has float64 actions", golden.file),
        };
        Self { recording: Recording::new(&golden), golden, actions, env, batch }
    }

    fn step(&mut self, step: usize) {
        let count = self.env.action_space().count();
        self.env.step(&self.actions[step * count..][..count].repeat(2), &mut self.batch).unwrap();
    }

    fn check_step(&self, step: usize) {
        for row in 0..2 {
            let place = format!("{} step {step} row {row}", self.golden.file);
            check_step(&place, &self.batch, row, &self.golden.info, &self.recording, step);
        }
    }

    fn check_reset(&self, episode: usize) {
        for row in 0..2 {
            let place = format!("{} episode {episode} row {row}", self.golden.file);
            assert!(self.batch.was_reset()[row], "{place}");
            assert_bits(&place, self.batch.obs(row), self.recording.reset_obs.row(episode));
            let expected = self.recording.reset_info.row(episode);
            check_infos(&place, self.batch.reset_infos(), &self.golden.reset_info, expected, row);
            assert!(self.batch.infos().all(|(_, values)| values.iter().all(|value| value.to_bits() == 0)), "{place}");
        }
    }
}

#[test]
fn the_next_step_resets() {
    for id in IDS {
        let mut pair = Pair::new(id, "next_step");
        let mut episodes = 0;
        for step in 0..pair.recording.terminated.len() {
            if step > 0 && pair.recording.reset_at.contains(&step) {
                episodes += 1;
                pair.step(0);
                pair.check_reset(episodes);
                assert_eq!(
                    (pair.batch.reward(), pair.batch.ended(0), pair.batch.final_obs(0)),
                    (&[0.0; 2][..], false, None)
                );
            }
            pair.step(step);
            pair.check_step(step);
            assert_eq!(pair.batch.was_reset(), [false; 2]);
        }
        assert!(episodes > 0);
    }
}

#[test]
fn the_same_step_resets() {
    for id in IDS {
        let mut pair = Pair::new(id, "same_step");
        assert_eq!((pair.batch.was_reset(), pair.batch.final_obs(1)), (&[true; 2][..], None));
        let mut episodes = 0;
        for step in 0..pair.recording.terminated.len() {
            pair.step(step);
            if !pair.batch.ended(1) {
                assert_eq!(pair.batch.final_obs(1), None);
                pair.check_step(step);
                continue;
            }
            episodes += 1;
            assert_eq!(pair.batch.terminated(), [pair.recording.terminated[step]; 2]);
            assert_eq!(pair.batch.truncated(), [pair.recording.truncated[step]; 2]);
            assert_bits("reward", &pair.batch.reward()[1..], pair.recording.reward.row(step));
            assert_bits("final_obs", pair.batch.final_obs(1).unwrap(), pair.recording.obs.row(step));
            let infos: Vec<_> = pair.golden.info.iter().map(|info| info.name.as_str()).collect();
            let finals = infos.iter().map(|name| (*name, pair.batch.final_info(name).unwrap()));
            check_infos("final_info", finals, &pair.golden.info, pair.recording.info.row(step), 1);
            if episodes < pair.recording.reset_at.len() {
                pair.check_reset(episodes);
            }
        }
        assert!(episodes > 0);
    }
}

#[test]
fn a_rollout_is_so_many_steps() {
    for id in IDS {
        let golden = Golden::of(id);
        let recording = Recording::new(&golden);
        let end = recording.reset_at[1];
        let steps = end + 3;
        let mut env = Env::new(&golden.options(), 2).unwrap();
        let (mut batch, mut out) = (env.batch(), env.rollout_batch(steps));
        let count = steps * env.action_space().count();
        env.seed(&[golden.seed; 2]).unwrap();
        env.reset(&mut batch).unwrap();
        match golden.actions() {
            Actions::Float32(actions) => env.rollout(&actions[..count].repeat(2), steps, &mut out).unwrap(),
            Actions::Float64(actions) => env.rollout(&actions[..count].repeat(2), steps, &mut out).unwrap(),
        }
        assert_eq!(out.rows(), 2 * steps);
        for start in [0, steps] {
            for step in 0..end {
                check_step(&golden.file, &out, start + step, &golden.info, &recording, step);
            }
            for step in start + end..start + steps {
                assert_bits("obs", out.obs(step), recording.obs.row(end - 1));
                assert_eq!((out.reward()[step], out.ended(step)), (0.0, true));
            }
        }
    }
}

#[test]
fn a_copied_row_goes_on_as_the_other_would() {
    for id in IDS {
        let golden = Golden::of(id);
        let mut replay = Replay::new(&golden, 3, 1);
        (0..5).for_each(|step| replay.step(step));
        replay.env.copy_row(1, &[true, false, false]).unwrap();
        replay.move_to(0);
        (5..replay.steps()).for_each(|step| replay.step(step));
    }
}

#[test]
fn an_image_of_all_rows_brings_them_all_back() {
    let golden = Golden::of("Humanoid-v5");
    let mut replay = Replay::new(&golden, 3, 2);
    (0..5).for_each(|step| replay.step(step));
    let image = replay.env.snapshot_all().unwrap();
    let others: Vec<_> = (0..2).map(|row| replay.env.read(row, "qpos").unwrap()).collect();
    (5..10).for_each(|step| replay.step(step));
    replay.env.restore_all(&image).unwrap();
    for (row, qpos) in others.iter().enumerate() {
        assert_bits("qpos", &replay.env.read(row, "qpos").unwrap(), qpos);
    }
    (5..replay.steps()).for_each(|step| replay.step(step));
}

#[test]
fn lanes() {
    let lanes = |count: i64| {
        let mut options = Options::new("Hopper-v5").unwrap();
        options.set("lanes", count).unwrap();
        Env::new(&options, 4).unwrap().lanes().unwrap()
    };
    assert_eq!(lanes(0), Lanes { count: 0, reason: r#"the option "lanes" is 0"#.to_string() });
    let default = lanes(-1);
    assert_eq!(default.count == 0, !default.reason.is_empty(), "{default:?}");
}
