//! Tests that read, set, copy and restore the state of rows.

use std::fs;

use mjenv::{Env, ErrorKind, Options};

use crate::golden::{assert_bits, folder, Actions, Golden};
use crate::replay::{check_infos, Replay};

/// The C tests compare all arrays. Here a few show that each call reaches the right row with the right numbers.
const ARRAYS: [&str; 6] = ["time", "qpos", "qvel", "ctrl", "xpos", "qfrc_actuator"];

#[test]
fn a_row_goes_through_the_recorded_stages() {
    for golden in Golden::all("state", "") {
        let mut env = Env::new(&golden.options(), 2).unwrap();
        let mut batch = env.batch::<f64>();
        let actions = match golden.actions() {
            Actions::Float32(actions) => actions,
            Actions::Float64(_) => panic!("{} has float64 actions", golden.file),
        };
        let nu = env.action_space().count();
        env.seed(.., &[golden.seed; 2]).unwrap();
        for (index, stage) in golden.bytes("stage").into_iter().enumerate() {
            let place = format!("{} stage {index}", golden.file);
            let action = &actions[index * nu..][..nu];
            match stage {
                0 => env.reset(.., &mut batch).unwrap(),
                1 => env.step(.., &action.repeat(2), &mut batch).unwrap(),
                2 => {
                    let (qpos, qvel) = (golden.table("set_qpos"), golden.table("set_qvel"));
                    (0..2).for_each(|row| env.set_state(row, qpos.row(index), qvel.row(index)).unwrap());
                }
                _ => {
                    let ctrl: Vec<_> = action.iter().map(|number| f64::from(*number)).collect();
                    (0..2).for_each(|row| env.simulate(row, &ctrl, 3).unwrap());
                }
            }
            if stage == 1 {
                assert_bits(&place, &batch.reward()[1..], golden.table("reward").row(index));
                check_infos(&place, batch.infos(), &golden.info, golden.table("info").row(index), 1);
            }
            env.observe(&mut batch).unwrap();
            assert_bits(&format!("{place} obs"), batch.obs(1), golden.table("obs").row(index));
            for name in ARRAYS {
                let (got, expected) = (env.read(1, name).unwrap(), golden.table(&format!("data.{name}")));
                assert_bits(&format!("{place} {name}"), &got, expected.row(index));
            }
        }
    }
}

#[test]
fn a_stream_is_numpys_and_can_be_replaced() {
    let text = fs::read_to_string(folder().join("random.txt")).unwrap();
    let mut env = Env::new(&Options::new("Reacher-v5").unwrap(), 2).unwrap();
    let (mut words, mut seed, mut state) = (Vec::new(), None, None);
    // The least significant of three words comes first.
    let words_of = |digits: &str| {
        let padded = format!("{digits:0>48}");
        [32, 16, 0].map(|first| u64::from_str_radix(&padded[first..][..16], 16).unwrap())
    };
    for (key, value) in text.lines().filter_map(|line| line.split_once(' ')) {
        match key {
            "seed" => seed = Some(words_of(value)),
            "state" => state = u128::from_str_radix(value, 16).ok(),
            "inc" => words.extend(seed.zip(state).zip(u128::from_str_radix(value, 16).ok())),
            _ => {}
        }
    }
    assert!(words.iter().filter(|((seed, _), _)| seed[2] > 0).count() > 0);
    for ((seed, state), increment) in words {
        let expected = [state as u64, (state >> 64) as u64, increment as u64, (increment >> 64) as u64, 0, 0];
        env.seed(.., &[[0; 3], seed]).unwrap();
        assert_eq!(env.stream(1).unwrap(), expected, "seed {seed:?}");
        if seed[1..] == [0; 2] {
            env.seed(&[1, 0], &[seed[0], 9]).unwrap();
            assert_eq!(env.stream(1).unwrap(), expected, "seed {seed:?}");
        }
    }

    let golden = Golden::of("Reacher-v5");
    env.seed(.., &[0, golden.seed]).unwrap();
    let stream = env.stream(1).unwrap();
    env.set_stream(0, &stream).unwrap();
    let mut batch = env.batch::<f64>();
    env.reset(.., &mut batch).unwrap();
    assert_bits("obs", batch.obs(0), golden.table("reset_obs").row(0));

    // The state of np.random.default_rng(42) in NumPy after integers(0, 10), which has used half of a draw.
    let words =
        [0xb05a_c563_5702_c3e7, 0x47c0_e8d1_1a13_4fa4, 0x66ca_f2e2_8d25_abff, 0xfa50_5436_c9a8_416e, 1, 3_324_115_917];
    env.set_stream(0, &words).unwrap();
    assert_eq!(env.stream(0).unwrap(), words);
}

#[test]
fn a_restored_row_goes_on_as_gymnasium_did() {
    for id in ["Humanoid-v5", "Pusher-v4"] {
        let golden = Golden::of(id);
        let mut replay = Replay::new(&golden, 1, 0);
        (0..10).for_each(|step| replay.step(step));
        let image = replay.env.snapshot(0).unwrap();
        (10..15).for_each(|step| replay.step(step));
        replay.env.restore(0, &image).unwrap();
        (10..replay.steps()).for_each(|step| replay.step(step));

        let mut other = Replay::new(&golden, 3, 2);
        other.step(0);
        let mut strict_off = golden.options();
        strict_off.set("strict", false).unwrap();
        let mut source = Env::new(&strict_off, 1).unwrap();
        assert!(source.restore(0, &image).is_err(), "an image of other options");
    }
}

#[test]
fn an_image_moves_between_rows_and_environments() {
    let golden = Golden::of("Ant-v5");
    let mut replay = Replay::new(&golden, 1, 0);
    (0..10).for_each(|step| replay.step(step));
    let image = replay.env.snapshot(0).unwrap();
    let expected = replay.env.read(0, "xpos").unwrap();

    let mut env = Env::new(&golden.options(), 3).unwrap();
    let mut batch = env.batch::<f64>();
    env.restore(1, &image).unwrap();
    assert_bits("xpos", &env.read(1, "xpos").unwrap(), &expected);
    env.observe(&mut batch).unwrap();
    assert_bits("obs", batch.obs(1), golden.table("obs").row(9));
}

#[test]
fn set_state_sets_what_is_observed() {
    let mut env = Env::new(&Options::new("InvertedPendulum-v5").unwrap(), 2).unwrap();
    let (mut batch, mut narrow) = (env.batch::<f64>(), env.batch::<f32>());
    env.set_state(1, &[0.1, -0.2], &[0.3, -0.4]).unwrap();
    env.observe(&mut batch).unwrap();
    assert_bits("obs", batch.obs(1), &[0.1, -0.2, 0.3, -0.4]);
    assert_bits("the other row", batch.obs(0), &[0.0; 4]);
    assert_bits("both", batch.observations(), &[0.0, 0.0, 0.0, 0.0, 0.1, -0.2, 0.3, -0.4]);
    env.observe(&mut narrow).unwrap();
    assert_eq!(narrow.obs(1), [0.1f32, -0.2, 0.3, -0.4]);
    assert_bits("qvel", &env.read(1, "qvel").unwrap(), &[0.3, -0.4]);
}

/// Reading needs no exclusive access, so several borrowers may read.
#[test]
fn reading_takes_a_shared_reference() {
    let mut env = Env::new(&Options::new("Reacher-v5").unwrap(), 2).unwrap();
    let mut batch = env.batch::<f64>();
    env.seed(.., &[1, 2]).unwrap();
    env.reset(.., &mut batch).unwrap();
    let (first, second) = (&env, &env);
    let space = first.action_space();
    let mut out = first.batch::<f64>();
    second.observe(&mut out).unwrap();
    assert_bits("obs", out.observations(), batch.observations());
    let mut values = [0.0; 4];
    first.read_into(1, "qpos", &mut values).unwrap();
    assert_bits("qpos", &second.read(1, "qpos").unwrap(), &values);
    assert_eq!(first.snapshot(0).unwrap(), second.snapshot(0).unwrap());
    assert_eq!(first.snapshot(..).unwrap(), second.snapshot(..).unwrap());
    assert_ne!(first.stream(0).unwrap(), second.stream(1).unwrap());
    assert_eq!(space.count(), 2);
}

#[test]
fn a_seed_may_be_given_in_words() {
    let golden = Golden::of("Hopper-v4.options");
    assert!(golden.seed > u32::MAX.into());
    let mut env = Env::new(&golden.options(), 2).unwrap();
    let mut batch = env.batch::<f64>();
    env.seed(1, &[[golden.seed, 0]]).unwrap();
    env.reset(.., &mut batch).unwrap();
    assert_bits("obs", batch.obs(1), golden.table("reset_obs").row(0));
}

#[test]
fn arrays_and_objects_have_mujocos_names() {
    let env = Env::new(&Options::new("Reacher-v5").unwrap(), 1).unwrap();
    assert_eq!(env.read(0, "nq").unwrap(), [4.0]);
    assert_eq!(env.read(0, "opt.timestep").unwrap(), [0.01]);
    let mut values = [-1.0; 5];
    assert_eq!(env.read_into(0, "qpos0", &mut values).unwrap(), 4);
    assert_eq!(values, [0.0, 0.0, 0.1, -0.1, -1.0]);
    let target = env.object_index("body", "target").unwrap();
    assert_eq!(env.object_count("body").unwrap(), env.read(0, "nbody").unwrap()[0] as usize);
    assert_eq!(env.object_count("tendon").unwrap(), 0);
    assert_eq!(env.object_name("body", target).unwrap(), "target");
    assert_eq!(env.read(0, "xpos").unwrap().len(), 3 * env.read(0, "nbody").unwrap()[0] as usize);
}

#[test]
fn sampled_actions_lie_in_the_space_and_follow_the_seed() {
    let mut env = Env::new(&Options::new("Humanoid-v4").unwrap(), 4).unwrap();
    let mut draw = |seed| {
        let mut actions = vec![0.0f32; 4 * 17];
        env.seed_actions(seed).unwrap();
        env.sample_actions(&mut actions).unwrap();
        actions
    };
    let (first, again, other) = (draw(1), draw(1), draw(2));
    assert!(first.iter().all(|action| action.abs() <= 0.4));
    assert_eq!(first, again);
    assert_ne!(first, other);
}

/// A box slides and turns above a floor. The model's stack is too small for contacts.
const BOX: &str = r#"<mujoco><size nstack="120"/><option timestep="0.01"/><worldbody><geom type="plane" size="9 9 1"/>
<body pos="0 0 3"><joint name="x" type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
<joint type="hinge" axis="0 1 0"/><geom type="box" size=".3 .3 .3"/></body></worldbody>
<actuator><motor joint="x"/></actuator></mujoco>"#;

#[test]
fn a_row_that_mujoco_fails_in_keeps_its_state_and_the_others_go_on() {
    let mut options = Options::new("HalfCheetah-v5").unwrap();
    options.set("xml_string", BOX).unwrap().set("num_threads", 2).unwrap();
    let (mut env, mut whole) = (Env::new(&options, 3).unwrap(), Env::new(&options, 3).unwrap());
    let (mut batch, mut wanted) = (env.batch::<f64>(), whole.batch::<f64>());
    for (env, batch) in [(&mut env, &mut batch), (&mut whole, &mut wanted)] {
        env.seed(.., &[1, 2, 3]).unwrap();
        env.reset(.., batch).unwrap();
    }
    env.set_state(1, &[0.0, -2.6, 0.0], &[0.0, -10.0, 0.0]).unwrap();
    let refused = env.step(.., &[1.0f32; 3], &mut batch).unwrap_err();
    assert_eq!(refused.kind(), ErrorKind::Physics);
    assert!(refused.to_string().contains("row 1"), "{refused}");
    whole.step(.., &[1.0f32; 3], &mut wanted).unwrap();
    assert_eq!([0, 1, 2].map(|row| batch.failed(row)), [false, true, false]);
    assert!((0..3).all(|row| !batch.diverged(row)));
    for row in [0, 2] {
        assert_bits("obs", batch.obs(row), wanted.obs(row));
    }
    assert_eq!(env.read(1, "qpos").unwrap(), [0.0, -2.6, 0.0]);
    env.reset(.., &mut batch).unwrap();
    env.step(.., &[1.0f32; 3], &mut batch).unwrap();
}

#[test]
fn a_diverged_row_is_told() {
    let mut env = Env::new(&Options::new("InvertedPendulum-v4").unwrap(), 2).unwrap();
    let mut batch = env.batch::<f64>();
    env.reset(.., &mut batch).unwrap();
    env.set_state(1, &[0.0, 0.0], &[1e200, 0.0]).unwrap();
    env.step(.., &[0.0, 0.0], &mut batch).unwrap();
    assert_eq!([0, 1].map(|row| (batch.failed(row), batch.diverged(row))), [(false, false), (false, true)]);
    env.reset(.., &mut batch).unwrap();
    assert!(!batch.diverged(1));
}
