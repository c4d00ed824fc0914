//! Repeats what Gymnasium did, and checks that all bits are equal.

use mjenv::{Batch, Env, Real, Role};

use crate::golden::{assert_bits, Actions, Golden, Info, Table};

/// What Gymnasium returned, step by step and episode by episode.
pub struct Recording {
    pub obs: Table,
    pub reward: Table,
    pub info: Table,
    pub qpos: Table,
    pub qvel: Table,
    pub reset_obs: Table,
    pub reset_info: Table,
    pub terminated: Vec<bool>,
    pub truncated: Vec<bool>,
    pub reset_at: Vec<usize>,
}

impl Recording {
    pub fn new(golden: &Golden) -> Self {
        Self {
            obs: golden.table("obs"),
            reward: golden.table("reward"),
            info: golden.table("info"),
            qpos: golden.table("qpos"),
            qvel: golden.table("qvel"),
            reset_obs: golden.table("reset_obs"),
            reset_info: golden.table("reset_info"),
            terminated: golden.flags("terminated"),
            truncated: golden.flags("truncated"),
            reset_at: golden.reset_at(),
        }
    }
}

/// Replays a recording in one of several rows. The other rows have other random streams and are never reset again.
pub struct Replay<'a> {
    golden: &'a Golden,
    recording: Recording,
    row: usize,
    pub env: Env,
    pub batch: Batch,
}

impl<'a> Replay<'a> {
    pub fn new(golden: &'a Golden, rows: usize, row: usize) -> Self {
        let mut options = golden.options();
        options.set("arrays", "qpos qvel").unwrap();
        if rows > 1 {
            options.set("strict", false).unwrap().set("num_threads", 2).unwrap();
        }
        let mut env = Env::new(&options, rows).unwrap();
        let mut batch = env.batch::<f64>();
        let others: Vec<_> = (0..rows).map(|other| other != row).collect();
        let seeds: Vec<_> = (0..rows as u64).map(|other| golden.seed + 1 + other).collect();
        env.seed(&others, &seeds).unwrap();
        env.reset(&others, &mut batch).unwrap();
        env.seed(&only(row, rows), &vec![golden.seed; rows]).unwrap();
        Self { golden, recording: Recording::new(golden), row, env, batch }
    }

    pub fn steps(&self) -> usize {
        self.recording.terminated.len()
    }

    /// Goes on with another row, which must be in the same state as the present one.
    pub fn move_to(&mut self, row: usize) {
        self.row = row;
    }

    /// Resets if the recording has a reset before `step`, then steps and compares everything.
    pub fn step(&mut self, step: usize) {
        if let Some(episode) = self.recording.reset_at.iter().position(|at| *at == step) {
            self.reset(episode);
        }
        match self.golden.actions() {
            Actions::Float32(actions) => self.step_with(step, &actions),
            Actions::Float64(actions) => self.step_with(step, &actions),
        }
    }

    fn reset(&mut self, episode: usize) {
        let (row, rows) = (self.row, self.batch.rows());
        self.env.reset(&only(row, rows), &mut self.batch).unwrap();
        let (place, batch) = (self.place(&format!("reset {episode}")), &self.batch);
        assert_bits(&format!("{place} obs"), batch.obs(row), self.recording.reset_obs.row(episode));
        let expected = self.recording.reset_info.row(episode);
        check_infos(&place, batch.reset_infos(), &self.golden.reset_info, expected, row);
        assert_eq!(batch.reward()[row].to_bits(), 0);
        assert!(batch.was_reset()[row] && !batch.ended(row) && !batch.failed(row));
    }

    fn step_with<A: Real>(&mut self, step: usize, actions: &[A]) {
        let (row, rows) = (self.row, self.batch.rows());
        let count = self.env.action_space().count();
        self.env.step(.., &actions[step * count..][..count].repeat(rows), &mut self.batch).unwrap();
        let (place, batch) = (self.place(&format!("step {step}")), &self.batch);
        check_step(&place, batch, row, &self.golden.info, &self.recording, step);
        assert!(!batch.was_reset()[row]);
        for (name, expected) in [("qpos", &self.recording.qpos), ("qvel", &self.recording.qvel)] {
            let (what, read) = (format!("{place} {name}"), self.env.read(row, name).unwrap());
            assert_bits(&what, &read, expected.row(step));
            assert_bits(&what, &batch.array(name).unwrap()[row * read.len()..][..read.len()], &read);
        }
    }

    fn place(&self, when: &str) -> String {
        format!("{} ({}row {} of {}), {when}:", self.golden.file, self.golden.machine, self.row, self.batch.rows())
    }
}

fn only(row: usize, rows: usize) -> Vec<bool> {
    (0..rows).map(|other| other == row).collect()
}

/// Compares what a step wrote for a row of a batch.
pub fn check_step(place: &str, batch: &Batch, row: usize, infos: &[Info], recording: &Recording, step: usize) {
    assert_bits(&format!("{place} obs"), batch.obs(row), recording.obs.row(step));
    assert_bits(&format!("{place} reward"), &batch.reward()[row..=row], recording.reward.row(step));
    assert_eq!(batch.terminated()[row], recording.terminated[step], "{place} terminated");
    assert_eq!(batch.truncated()[row], recording.truncated[step], "{place} truncated");
    check_infos(place, batch.infos(), infos, recording.info.row(step), row);
}

pub fn check_infos<'a>(
    place: &str,
    got: impl ExactSizeIterator<Item = (&'a str, &'a [f64])>,
    infos: &[Info],
    expected: &[f64],
    row: usize,
) {
    assert_eq!(got.len(), infos.len(), "{place} infos");
    let mut offset = 0;
    for ((name, values), info) in got.zip(infos) {
        assert_eq!(name, info.name, "{place}");
        let (values, expected) = (&values[row * info.count..][..info.count], &expected[offset..][..info.count]);
        assert_bits(&format!("{place} {name}"), values, expected);
        offset += info.count;
    }
}

pub fn described(env: &Env, role: Role) -> Vec<Info> {
    env.fields(role)
        .map(|field| Info { name: field.name.into_owned(), count: field.count, dtype: field.dtype })
        .collect()
}

fn replay_all(golden: &Golden, rows: usize, row: usize) {
    let mut replay = Replay::new(golden, rows, row);
    assert_eq!(described(&replay.env, Role::Info), golden.info, "{}", golden.file);
    assert_eq!(described(&replay.env, Role::ResetInfo), golden.reset_info, "{}", golden.file);
    for step in 0..replay.steps() {
        replay.step(step);
    }
}

#[test]
fn every_id_gives_gymnasiums_bits() {
    for id in mjenv::ids() {
        for golden in Golden::all("trajectories", &format!("{id}.")) {
            assert_eq!(golden.id, id);
            replay_all(&golden, 1, 0);
        }
    }
}

#[test]
fn models_of_ones_own_give_gymnasiums_bits() {
    for golden in Golden::all("custom", "") {
        replay_all(&golden, 1, 0);
    }
}

#[test]
fn a_row_among_others_gives_the_same_bits() {
    for prefix in ["Ant-v5.", "Humanoid-v5.golden", "Reacher-v4.", "Swimmer-v5."] {
        for golden in Golden::all("trajectories", prefix) {
            for row in 0..3 {
                replay_all(&golden, 3, row);
            }
        }
    }
}
