//! Tests send and recv: the outputs of all rows equal Gymnasium's, in whatever order the rows are received.

use std::time::Duration;

use mjenv::{Batch, Env, ErrorKind, Options};

use crate::golden::{assert_bits, Actions, Golden};
use crate::replay::Recording;

const ROWS: usize = 5;

fn env_of(golden: &Golden, threads: i64) -> (Env, Batch) {
    let mut options = golden.options();
    options.set("num_threads", threads).unwrap().set("autoreset_mode", "next_step").unwrap();
    options.set("arrays", "qpos").unwrap();
    let mut env = Env::new(&options, ROWS).unwrap();
    let mut batch = env.batch::<f64>();
    env.seed(.., &[golden.seed; ROWS]).unwrap();
    env.reset(.., &mut batch).unwrap();
    (env, batch)
}

/// The part of an info that belongs to a row.
fn part(values: &[f64], row: usize) -> &[f64] {
    let count = values.len() / ROWS;
    &values[row * count..][..count]
}

/// Where each row is in the recording.
struct Rows {
    golden: Golden,
    recording: Recording,
    actions: Vec<f32>,
    step: [usize; ROWS],
}

impl Rows {
    fn of(id: &str) -> Self {
        let golden = Golden::of(id);
        let actions = match golden.actions() {
            Actions::Float32(actions) => actions,
            Actions::Float64(_) => panic!("{} has float64 actions", golden.file),
        };
        Self { recording: Recording::new(&golden), golden, actions, step: [0; ROWS] }
    }

    fn action(&self, row: usize) -> &[f32] {
        let count = self.actions.len() / self.recording.terminated.len();
        &self.actions[self.step[row] * count..][..count]
    }

    /// Compares the outputs of a row with the recorded step, or with the reset before it.
    fn check(&mut self, batch: &Batch, row: usize) {
        let step = self.step[row];
        let place = format!("{} row {row} step {step}", self.golden.file);
        assert!(!batch.failed(row) && !batch.diverged(row));
        if batch.was_reset()[row] {
            let episode = self.recording.reset_at.iter().position(|&at| at == step).unwrap();
            assert_bits(&place, batch.obs(row), self.recording.reset_obs.row(episode));
            assert_eq!((batch.reward()[row], batch.ended(row), batch.final_obs(row)), (0.0, false, None));
            self.check_infos(&place, &self.golden.reset_info, self.recording.reset_info.row(episode), |name| {
                part(batch.reset_info(name).unwrap(), row)
            });
            return;
        }
        assert_bits(&place, batch.obs(row), self.recording.obs.row(step));
        assert_bits(&place, &[batch.reward()[row]], self.recording.reward.row(step));
        assert_bits(&place, part(batch.array("qpos").unwrap(), row), self.recording.qpos.row(step));
        assert_eq!(batch.terminated()[row], self.recording.terminated[step]);
        assert_eq!(batch.truncated()[row], self.recording.truncated[step]);
        self.check_infos(&place, &self.golden.info, self.recording.info.row(step), |name| {
            part(batch.info(name).unwrap(), row)
        });
        self.step[row] += 1;
    }

    fn check_infos<'a>(
        &self,
        place: &str,
        infos: &[crate::golden::Info],
        expected: &[f64],
        got: impl Fn(&str) -> &'a [f64],
    ) {
        let mut offset = 0;
        for info in infos {
            assert_bits(place, got(&info.name), &expected[offset..][..info.count]);
            offset += info.count;
        }
    }
}

#[test]
fn rows_go_on_as_they_are_received() {
    for (id, threads) in [("Hopper-v5", 1), ("Reacher-v4", 3), ("Humanoid-v5", 2)] {
        let mut rows = Rows::of(id);
        let end = rows.recording.terminated.len();
        let (mut env, mut batch) = env_of(&rows.golden, threads);
        let mut received = Vec::new();
        env.send(.., &rows.action(0).repeat(ROWS)).unwrap();
        let mut under_way = ROWS;
        while under_way > 0 {
            let least = under_way.min(2);
            env.recv(least, None, &mut received, &mut batch).unwrap();
            assert!(received.len() >= least);
            received.iter().for_each(|&row| rows.check(&batch, row));
            let on: Vec<_> = received.iter().copied().filter(|&row| rows.step[row] < end).collect();
            let actions: Vec<_> = on.iter().flat_map(|&row| rows.action(row).to_vec()).collect();
            env.send(&on, &actions).unwrap();
            under_way = under_way - received.len() + on.len();
        }
        assert_eq!(rows.step, [end; ROWS], "{id}");
    }
}

#[test]
fn a_reset_in_the_same_step_keeps_the_end() {
    let rows = Rows::of("Hopper-v5");
    let end = rows.recording.reset_at[1];
    let mut options = rows.golden.options();
    options.set("autoreset_mode", "same_step").unwrap();
    let mut env = Env::new(&options, 1).unwrap();
    let (mut batch, mut received) = (env.batch::<f64>(), Vec::new());
    env.seed(.., &[rows.golden.seed]).unwrap();
    env.reset(.., &mut batch).unwrap();
    for step in 0..end {
        env.send(.., &rows.actions[step * 3..][..3]).unwrap();
        env.recv(1, None, &mut received, &mut batch).unwrap();
        assert_eq!(received, [0]);
        assert_eq!(batch.final_obs(0).is_some(), step + 1 == end);
    }
    assert_bits("final_obs", batch.final_obs(0).unwrap(), rows.recording.obs.row(end - 1));
    assert_bits("obs", batch.obs(0), rows.recording.reset_obs.row(1));
    let (mut offset, expected) = (0, rows.recording.info.row(end - 1));
    for info in &rows.golden.info {
        assert_bits(&info.name, batch.final_info(&info.name).unwrap(), &expected[offset..][..info.count]);
        offset += info.count;
    }
}

#[test]
fn rows_that_are_not_received_keep_their_outputs() {
    let rows = Rows::of("Ant-v5");
    let (mut env, mut batch) = env_of(&rows.golden, 3);
    let before = batch.clone();
    let mut received = Vec::new();
    env.send(&[3, 1], &rows.action(0).repeat(2)).unwrap();
    env.recv(2, Some(Duration::from_secs(600)), &mut received, &mut batch).unwrap();
    received.sort_unstable();
    assert_eq!(received, [1, 3]);
    for row in 0..ROWS {
        let expected = if received.contains(&row) { rows.recording.obs.row(0) } else { before.obs(row) };
        assert_bits("obs", batch.obs(row), expected);
    }
}

/// With two threads nothing in the call waits for the rows, so a timeout of 0 returns those that are done.
#[test]
fn a_timeout_returns_the_rows_that_are_done() {
    let rows = Rows::of("Humanoid-v5");
    let (mut env, mut batch) = env_of(&rows.golden, 2);
    let (mut received, mut all) = (Vec::new(), Vec::new());
    env.send(.., &rows.action(0).repeat(ROWS)).unwrap();
    while all.len() < ROWS {
        env.recv(ROWS - all.len(), Some(Duration::from_millis(0)), &mut received, &mut batch).unwrap();
        all.extend_from_slice(&received);
    }
    all.sort_unstable();
    assert_eq!(all, [0, 1, 2, 3, 4]);
    (0..ROWS).for_each(|row| assert_bits("obs", batch.obs(row), rows.recording.obs.row(0)));
}

#[test]
fn refusals() {
    let golden = Golden::of("Reacher-v5");
    let (mut env, mut batch) = env_of(&golden, 2);
    let mut other = Env::new(&golden.options(), 1).unwrap().batch::<f64>();
    let mut received = vec![7];
    let kind = |result: Result<(), mjenv::Error>| result.unwrap_err().kind();
    let action = [0.0f32; ROWS * 2];
    assert_eq!(kind(env.recv(1, None, &mut received, &mut batch)), ErrorKind::NotPending);
    assert!(received.is_empty());
    assert_eq!(kind(env.send(.., &action[1..])), ErrorKind::Size);
    assert_eq!(kind(env.send(.., &[f32::NAN; ROWS * 2])), ErrorKind::Value);
    assert_eq!(kind(env.send(&[ROWS], &action[..2])), ErrorKind::Value);
    assert_eq!(kind(env.send(&[1, 1], &action[..4])), ErrorKind::Pending);
    assert_eq!(kind(env.send(&[0usize; 0], &action[..2])), ErrorKind::Size);
    env.send::<f32>(&[0usize; 0], &[]).unwrap();
    env.send(&[3, 1], &action[..4]).unwrap();
    assert_eq!(kind(env.send(.., &action)), ErrorKind::Pending);
    assert_eq!(kind(env.send(&[1], &action[..2])), ErrorKind::Pending);
    assert_eq!(kind(env.recv(3, None, &mut received, &mut batch)), ErrorKind::Size);
    assert_eq!(kind(env.recv(2, None, &mut received, &mut other)), ErrorKind::Size);
    assert_eq!(kind(env.reset(.., &mut batch)), ErrorKind::Pending);
    assert_eq!(kind(env.reset(&[true; ROWS], &mut batch)), ErrorKind::Pending);
    assert_eq!(kind(env.snapshot(0).map(drop)), ErrorKind::Pending);
    env.recv(2, None, &mut received, &mut batch).unwrap();
    assert_eq!(received.len(), 2);
}

#[test]
fn a_diverged_row_is_told() {
    let mut env = Env::new(&Options::new("HalfCheetah-v5").unwrap(), 2).unwrap();
    let (mut batch, mut received) = (env.batch::<f64>(), Vec::new());
    env.reset(.., &mut batch).unwrap();
    let mut qvel = [0.0; 9];
    qvel[0] = 1e11;
    env.set_state(1, &[0.0; 9], &qvel).unwrap();
    env.send(.., &[0.0f32; 12]).unwrap();
    env.recv(2, None, &mut received, &mut batch).unwrap();
    assert_eq!([0, 1].map(|row| (batch.failed(row), batch.diverged(row))), [(false, false), (false, true)]);
}

#[test]
fn it_may_move_to_another_thread_under_way() {
    let rows = Rows::of("Ant-v5");
    let (mut env, mut batch) = env_of(&rows.golden, 3);
    env.send(.., &rows.action(0).repeat(ROWS)).unwrap();
    let batch = std::thread::spawn(move || {
        env.recv(ROWS, None, &mut Vec::new(), &mut batch).unwrap();
        batch
    })
    .join()
    .unwrap();
    (0..ROWS).for_each(|row| assert_bits("obs", batch.obs(row), rows.recording.obs.row(0)));
}

#[test]
fn a_masked_step_leaves_the_other_rows_alone() {
    let rows = Rows::of("Ant-v5");
    let (mut env, mut batch) = env_of(&rows.golden, 2);
    let before = batch.clone();
    let image = env.snapshot(1).unwrap();
    let mask = [true, false, true, false, false];
    env.step(&mask, &rows.action(0).repeat(ROWS), &mut batch).unwrap();
    for (row, &stepped) in mask.iter().enumerate() {
        let expected = if stepped { rows.recording.obs.row(0) } else { before.obs(row) };
        assert_bits("obs", batch.obs(row), expected);
    }
    assert_eq!(env.snapshot(1).unwrap(), image);
    let short = env.step(&mask[1..], &rows.action(0).repeat(ROWS), &mut batch);
    assert_eq!(short.unwrap_err().kind(), ErrorKind::Size);
}
