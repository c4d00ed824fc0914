//! Steps in two halves: all rows are what Gymnasium recorded, whichever are received first.

use mjenv::{Env, ErrorKind, Options, Pipeline};

use crate::golden::{assert_bits, Actions, Golden};
use crate::replay::Recording;

const ROWS: usize = 5;

fn pipeline(golden: &Golden, threads: i64) -> Pipeline {
    let mut options = golden.options();
    options.set("num_threads", threads).unwrap().set("autoreset_mode", "next_step").unwrap();
    options.set("arrays", "qpos").unwrap();
    let mut env = Env::new(&options, ROWS).unwrap();
    env.seed(&[golden.seed; ROWS]).unwrap();
    let mut pipeline = env.pipeline();
    pipeline.reset().unwrap();
    pipeline
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

    /// Compares what the pipeline tells of a row with the recorded step, or with the reset before it.
    fn check(&mut self, pipeline: &Pipeline, row: usize) {
        let (step, got) = (self.step[row], pipeline.row(row).unwrap());
        let place = format!("{} row {row} step {step}", self.golden.file);
        assert!(!got.failed());
        if got.was_reset() {
            let episode = self.recording.reset_at.iter().position(|&at| at == step).unwrap();
            assert_bits(&place, got.obs(), self.recording.reset_obs.row(episode));
            assert_eq!((got.reward(), got.ended(), got.final_obs()), (0.0, false, None));
            self.check_infos(&place, &self.golden.reset_info, self.recording.reset_info.row(episode), |name| {
                got.reset_info(name).unwrap()
            });
            return;
        }
        assert_bits(&place, got.obs(), self.recording.obs.row(step));
        assert_bits(&place, &[got.reward()], self.recording.reward.row(step));
        assert_bits(&place, got.array("qpos").unwrap(), self.recording.qpos.row(step));
        assert_eq!(got.terminated(), self.recording.terminated[step]);
        assert_eq!(got.truncated(), self.recording.truncated[step]);
        self.check_infos(&place, &self.golden.info, self.recording.info.row(step), |name| got.info(name).unwrap());
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
        let mut pipeline = pipeline(&rows.golden, threads);
        pipeline.send(&rows.action(0).repeat(ROWS)).unwrap();
        while pipeline.under_way() > 0 {
            let least = pipeline.under_way().min(2);
            let received = pipeline.recv(least).unwrap().to_vec();
            assert!(received.len() >= least);
            assert_eq!(received, pipeline.received());
            received.iter().for_each(|&row| rows.check(&pipeline, row));
            let on: Vec<_> = received.into_iter().filter(|&row| rows.step[row] < end).collect();
            let actions: Vec<_> = on.iter().flat_map(|&row| rows.action(row).to_vec()).collect();
            pipeline.send_rows(&on, &actions).unwrap();
            assert!(on.iter().all(|&row| pipeline.row(row).is_none()));
        }
        assert_eq!(rows.step, [end; ROWS], "{id}");
    }
}

#[test]
fn a_reset_in_the_same_step_keeps_the_end() {
    let golden = Golden::of("Hopper-v5");
    let rows = Rows::of("Hopper-v5");
    let end = rows.recording.reset_at[1];
    let mut options = golden.options();
    options.set("autoreset_mode", "same_step").unwrap();
    let mut env = Env::new(&options, 1).unwrap();
    env.seed(&[golden.seed]).unwrap();
    let mut pipeline = env.pipeline();
    pipeline.reset().unwrap();
    for step in 0..end {
        assert_eq!(pipeline.row(0).unwrap().final_obs(), None);
        pipeline.send(&rows.actions[step * 3..][..3]).unwrap();
        pipeline.recv(1).unwrap();
    }
    let row = pipeline.row(0).unwrap();
    assert_bits("final_obs", row.final_obs().unwrap(), rows.recording.obs.row(end - 1));
    assert_bits("obs", row.obs(), rows.recording.reset_obs.row(1));
    let (mut offset, expected) = (0, rows.recording.info.row(end - 1));
    for info in &golden.info {
        assert_bits(&info.name, row.final_info(&info.name).unwrap(), &expected[offset..][..info.count]);
        offset += info.count;
    }
}

#[test]
fn finishing_waits() {
    let golden = Golden::of("Ant-v5");
    let rows = Rows::of("Ant-v5");
    for threads in [1, 3] {
        let mut pipeline = pipeline(&golden, threads);
        pipeline.send(&rows.action(0).repeat(ROWS)).unwrap();
        let (mut env, mut batch) = pipeline.finish();
        for row in 0..ROWS {
            assert_bits("obs", batch.obs(row), rows.recording.obs.row(0));
        }
        env.step(&rows.action(0).repeat(ROWS), &mut batch).unwrap();
        let mut pipeline = env.pipeline_f32();
        pipeline.send(&rows.action(0).repeat(ROWS)).unwrap();
        drop(pipeline);
    }
}

#[test]
fn refusals() {
    let golden = Golden::of("Reacher-v5");
    let mut pipeline = pipeline(&golden, 2);
    let status = |result: Result<(), mjenv::Error>| result.unwrap_err().kind();
    let action = [0.0f32; ROWS * 2];
    assert_eq!(status(pipeline.recv(1).map(drop)), ErrorKind::State);
    assert_eq!(status(pipeline.send(&action[1..])), ErrorKind::Size);
    assert_eq!(status(pipeline.send(&[f32::NAN; ROWS * 2])), ErrorKind::Value);
    assert_eq!(status(pipeline.send_rows(&[ROWS], &action[..2])), ErrorKind::Value);
    assert_eq!(status(pipeline.send_rows(&[1, 1], &action[..4])), ErrorKind::State);
    assert_eq!(status(pipeline.send_rows(&[0; ROWS + 1], &[0.0f32; ROWS * 2 + 2])), ErrorKind::Size);
    pipeline.send_rows(&[3, 1], &action[..4]).unwrap();
    assert_eq!(status(pipeline.send(&action)), ErrorKind::State);
    assert_eq!(status(pipeline.send_rows(&[1], &action[..2])), ErrorKind::State);
    assert_eq!(status(pipeline.recv(3).map(drop)), ErrorKind::Size);
    assert_eq!(status(pipeline.reset()), ErrorKind::State);
    assert_eq!(status(pipeline.reset_where(&[true; ROWS])), ErrorKind::State);
    assert!(pipeline.row(1).is_none() && pipeline.row(0).is_some());
    let mut received = pipeline.recv(2).unwrap().to_vec();
    received.sort_unstable();
    assert_eq!(received, [1, 3]);
    let row = pipeline.row(1).unwrap();
    assert_eq!(row.info("nothing").unwrap_err().kind(), ErrorKind::Name);
    assert_eq!(row.final_info("reward_dist").unwrap_err().kind(), ErrorKind::State);
    assert_eq!(format!("{row:?}"), "Row { row: 1 }");
}

#[test]
fn a_diverged_row_is_told() {
    let mut env = Env::new(&Options::new("HalfCheetah-v5").unwrap(), 2).unwrap();
    let mut batch = env.batch();
    env.reset(&mut batch).unwrap();
    let mut qvel = [0.0; 9];
    qvel[0] = 1e11;
    env.set_state(1, &[0.0; 9], &qvel).unwrap();
    let mut pipeline = env.pipeline();
    pipeline.send(&[0.0f32; 12]).unwrap();
    pipeline.recv(2).unwrap();
    assert!(!pipeline.row(0).unwrap().failed() && pipeline.row(1).unwrap().failed());
}

#[test]
fn it_may_move_to_another_thread() {
    let golden = Golden::of("Ant-v5");
    let rows = Rows::of("Ant-v5");
    let mut moved = pipeline(&golden, 3);
    moved.send(&rows.action(0).repeat(ROWS)).unwrap();
    let mut moved = std::thread::spawn(move || {
        moved.recv(2).unwrap();
        moved
    })
    .join()
    .unwrap();
    while moved.under_way() > 0 {
        moved.recv(1).unwrap();
    }
    (0..ROWS).for_each(|row| assert_bits("obs", moved.row(row).unwrap().obs(), rows.recording.obs.row(0)));
}
