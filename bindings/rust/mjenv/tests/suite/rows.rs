//! Tests automatic resets, rollouts and copies of rows.

use mjenv::{Batch, Env, Rows};

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
        let mut batch = env.batch::<f64>();
        env.seed(.., &[golden.seed; 2]).unwrap();
        env.reset(.., &mut batch).unwrap();
        let actions = match golden.actions() {
            Actions::Float32(actions) => actions,
            Actions::Float64(_) => panic!("{} has float64 actions", golden.file),
        };
        Self { recording: Recording::new(&golden), golden, actions, env, batch }
    }

    fn step(&mut self, step: usize) {
        let count = self.env.action_space().count();
        self.env.step(.., &self.actions[step * count..][..count].repeat(2), &mut self.batch).unwrap();
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
        let (mut batch, mut out) = (env.batch::<f64>(), env.rollout_batch::<f64>(steps));
        let count = steps * env.action_space().count();
        env.seed(.., &[golden.seed; 2]).unwrap();
        env.reset(.., &mut batch).unwrap();
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
    let image = replay.env.snapshot(..).unwrap();
    let others: Vec<_> = (0..2).map(|row| replay.env.read(row, "qpos").unwrap()).collect();
    (5..10).for_each(|step| replay.step(step));
    replay.env.restore(.., &image).unwrap();
    for (row, qpos) in others.iter().enumerate() {
        assert_bits("qpos", &replay.env.read(row, "qpos").unwrap(), qpos);
    }
    (5..replay.steps()).for_each(|step| replay.step(step));
}

/// What each way to choose rows chooses, of four rows, in the order in which their arrays hold them.
fn choices(none: &Vec<usize>) -> [(Rows<'_>, &[usize]); 7] {
    [
        (Rows::from(..), &[0, 1, 2, 3]),
        (2.into(), &[2]),
        ((&[3usize, 1]).into(), &[3, 1]),
        ((&[0usize, 2, 3][..]).into(), &[0, 2, 3]),
        (none.into(), &[]),
        ((&[true, false, true, false]).into(), &[0, 2]),
        ((&[false; 4]).into(), &[]),
    ]
}

/// Whether an array holds the elements of all rows for these rows, and not of the chosen rows alone.
fn are_all(rows: Rows) -> bool {
    matches!(rows, Rows::All | Rows::Mask(_))
}

/// The first of the chosen rows repeats the recording, and the others have other seeds. Rows that are not chosen keep
/// their state and their outputs.
#[test]
fn rows_are_chosen_in_every_way() {
    let golden = Golden::of("Ant-v5");
    let recording = Recording::new(&golden);
    let actions = match golden.actions() {
        Actions::Float32(actions) => actions,
        Actions::Float64(_) => panic!("{} has float64 actions", golden.file),
    };
    for (rows, chosen) in choices(&Vec::new()) {
        let mut env = Env::new(&golden.options(), 4).unwrap();
        let (mut batch, mut received) = (env.batch::<f64>(), Vec::new());
        env.seed(.., &[1, 2, 3, 4]).unwrap();
        env.reset(.., &mut batch).unwrap();
        let before = batch.clone();
        let images: Vec<_> = (0..4).map(|row| env.snapshot(row).unwrap()).collect();
        let check = |env: &Env, batch: &Batch, expected: &[f64]| {
            for (row, image) in images.iter().enumerate() {
                let place = format!("row {row} of {rows:?}");
                if chosen.first() == Some(&row) {
                    assert_bits(&place, batch.obs(row), expected);
                } else if chosen.contains(&row) {
                    assert!(batch.obs(row) != expected && batch.obs(row) != before.obs(row), "{place}");
                } else {
                    assert_bits(&place, batch.obs(row), before.obs(row));
                    assert_eq!(&env.snapshot(row).unwrap(), image, "{place}");
                }
            }
        };

        let places = if are_all(rows) { &[0, 1, 2, 3] } else { chosen };
        let first = |row: &usize| chosen.first() == Some(row);
        let seeds: Vec<_> = places.iter().map(|row| if first(row) { golden.seed } else { 100 + *row as u64 }).collect();
        // The library would refuse NaN in a row that is chosen.
        let action = |step: usize| -> Vec<f32> {
            let of = |row: &usize| match (first(row), chosen.contains(row)) {
                (true, _) => actions[step * 8..][..8].to_vec(),
                (_, true) => vec![0.1; 8],
                _ => vec![f32::NAN; 8],
            };
            places.iter().flat_map(of).collect()
        };
        env.seed(rows, &seeds).unwrap();
        env.reset(rows, &mut batch).unwrap();
        check(&env, &batch, recording.reset_obs.row(0));
        env.step(rows, &action(0), &mut batch).unwrap();
        check(&env, &batch, recording.obs.row(0));
        env.send(rows, &action(1)).unwrap();
        if !chosen.is_empty() {
            env.recv(chosen.len(), None, &mut received, &mut batch).unwrap();
            check(&env, &batch, recording.obs.row(1));
        }
    }
}

#[test]
fn rows_are_written_in_every_way() {
    let golden = Golden::of("Hopper-v5");
    for (rows, chosen) in choices(&Vec::new()) {
        let mut env = Env::new(&golden.options(), 4).unwrap();
        let read = |env: &Env, name| [0, 1, 2, 3].map(|row| env.read(row, name).unwrap()[0]);
        let expected = |own: f64, of: &dyn Fn(usize) -> f64| {
            [0, 1, 2, 3].map(|row| chosen.iter().position(|&other| other == row).map_or(own, |_| of(row)))
        };
        env.write(rows, "opt.timestep", &[0.004]).unwrap();
        assert_eq!(read(&env, "opt.timestep"), expected(0.002, &|_| 0.004), "{rows:?}");
        let places = if are_all(rows) { &[0, 1, 2, 3] } else { chosen };
        let values: Vec<_> = places.iter().map(|&row| 0.001 * (5 + row) as f64).collect();
        if !values.is_empty() {
            env.write(rows, "opt.timestep", &values).unwrap();
        }
        assert_eq!(read(&env, "opt.timestep"), expected(0.002, &|row| 0.001 * (5 + row) as f64), "{rows:?}");

        // The mass of the whole model, which MuJoCo computes when it compiles a model.
        let mut masses = env.read(0, "body_mass").unwrap();
        let total: f64 = masses.iter().sum();
        masses.iter_mut().for_each(|mass| *mass *= 2.0);
        env.write(.., "body_mass", &masses).unwrap();
        env.set_constants(rows).unwrap();
        for (got, wanted) in read(&env, "body_subtreemass").iter().zip(expected(total, &|_| 2.0 * total)) {
            assert!((got - wanted).abs() < 1e-12 * total, "{got}, not {wanted}, {rows:?}");
        }
    }
}

#[test]
fn rows_are_copied_in_every_way() {
    let golden = Golden::of("Reacher-v4");
    for (rows, chosen) in choices(&Vec::new()) {
        let mut env = Env::new(&golden.options(), 4).unwrap();
        let mut batch = env.batch::<f64>();
        env.seed(.., &[1, golden.seed, 3, 4]).unwrap();
        env.reset(.., &mut batch).unwrap();
        let before = batch.clone();
        env.copy_row(1, rows).unwrap();
        env.observe(&mut batch).unwrap();
        for row in 0..4 {
            let from = if chosen.contains(&row) { 1 } else { row };
            assert_bits(&format!("row {row} of {rows:?}"), batch.obs(row), before.obs(from));
        }
    }
}

/// The numbers of lanes are those of the CPU, and the bits are those of the recording with any of them.
#[test]
fn lanes() {
    const AUTO: i64 = -1;
    let golden = Golden::of("Hopper-v5");
    let with_lanes = |count: i64, rows: usize| {
        let mut options = golden.options();
        match count {
            AUTO => options.set("lanes", "auto").unwrap(),
            _ => options.set("lanes", count).unwrap(),
        };
        Env::new(&options, rows).unwrap()
    };
    let told = |env: &mut Env| env.lanes().map(|lanes| (lanes.count, lanes.reason)).unwrap();
    #[cfg(target_arch = "x86_64")]
    let widest = if std::is_x86_feature_detected!("avx2") { 4 } else { 2 };
    #[cfg(not(target_arch = "x86_64"))]
    let widest = 2;
    assert_eq!(told(&mut with_lanes(0, 4)), (0, r#"the option "lanes" is 0"#.to_string()));
    assert_eq!(told(&mut with_lanes(2, 4)), (2, String::new()));
    assert_eq!(told(&mut with_lanes(AUTO, 8)), (widest, String::new()));
    assert_eq!(told(&mut with_lanes(AUTO, 1)), (0, "the environment has only one row".to_string()));
    let stages = with_lanes(2, 4).lane_stages().unwrap();
    assert!(stages.iter().any(|(stage, how)| stage == "energies" && how == "absent"), "{stages:?}");

    let recording = Recording::new(&golden);
    let actions = match golden.actions() {
        Actions::Float32(actions) => actions,
        Actions::Float64(_) => panic!("{} has float64 actions", golden.file),
    };
    for lanes in [0, 2, AUTO] {
        let mut env = with_lanes(lanes, 5);
        let mut batch = env.batch::<f64>();
        env.seed(.., &[golden.seed; 5]).unwrap();
        env.reset(.., &mut batch).unwrap();
        for step in 0..recording.reset_at[1] {
            env.step(.., &actions[step * 3..][..3].repeat(5), &mut batch).unwrap();
            for row in 0..5 {
                check_step(&format!("{lanes} lanes, step {step}"), &batch, row, &golden.info, &recording, step);
            }
        }
        if lanes == 2 {
            let model = env.object_count("body").unwrap();
            env.write(0, "xfrc_applied", &vec![1.0; 6 * model]).unwrap();
            assert_eq!(told(&mut env), (2, String::new())); // forces keep rows in lanes
        }
    }
}
