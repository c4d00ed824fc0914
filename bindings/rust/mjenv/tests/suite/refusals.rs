//! Tests that bad input returns the right kind of error, that the message names the wrong argument, and that nothing
//! else changes.

use std::fmt::Debug;

use mjenv::{Batch, Env, Error, ErrorKind, Options, Result};

#[track_caller]
fn assert_refused<T: Debug>(result: Result<T>, status: ErrorKind, culprits: &[&str]) {
    let error: Error = result.unwrap_err();
    assert_eq!(error.kind(), status, "{error}");
    for culprit in culprits {
        assert!(error.message().contains(culprit), "{culprit:?} is not in {:?}", error.message());
    }
    assert_eq!(error.to_string(), error.message());
    let _: Box<dyn std::error::Error + Send + Sync> = error.into();
}

fn bits(batch: &Batch) -> Vec<u64> {
    let infos = batch.infos().chain(batch.reset_infos()).flat_map(|(_, values)| values);
    let numbers = batch.observations().iter().chain(batch.reward()).chain(infos).map(|number| number.to_bits());
    let flags = batch.terminated().iter().chain(batch.truncated()).map(|flag| u64::from(*flag));
    let failures = (0..batch.rows()).map(|row| u64::from(batch.failed(row)) + 2 * u64::from(batch.diverged(row)));
    numbers.chain(flags).chain(failures).collect()
}

/// Two equal environments in the middle of an episode. Only one of them gets bad input.
struct Pair {
    env: Env,
    batch: Batch,
    twin: Env,
    twin_batch: Batch,
    actions: Vec<f32>,
}

impl Pair {
    fn new(id: &str, rows: usize) -> Self {
        let options = Options::new(id).unwrap();
        let (mut env, mut twin) = (Env::new(&options, rows).unwrap(), Env::new(&options, rows).unwrap());
        let (mut batch, mut twin_batch) = (env.batch::<f64>(), twin.batch::<f64>());
        let seeds: Vec<_> = (0..rows as u64).collect();
        for (env, batch) in [(&mut env, &mut batch), (&mut twin, &mut twin_batch)] {
            env.seed(.., &seeds).unwrap();
            env.seed_actions(5).unwrap();
            env.reset(.., batch).unwrap();
        }
        let actions = vec![0.0; rows * env.action_space().count()];
        let mut pair = Self { env, batch, twin, twin_batch, actions };
        pair.step();
        pair
    }

    fn step(&mut self) {
        for (env, batch) in [(&mut self.env, &mut self.batch), (&mut self.twin, &mut self.twin_batch)] {
            env.sample_actions(&mut self.actions).unwrap();
            env.step(.., &self.actions, batch).unwrap();
        }
        assert_eq!(bits(&self.batch), bits(&self.twin_batch));
    }

    /// Checks that the bad input is refused and changes no outputs, and that the episode goes on like the twin's.
    #[track_caller]
    fn refuses<T: Debug>(
        &mut self,
        status: ErrorKind,
        culprits: &[&str],
        input: impl FnOnce(&mut Env, &mut Batch) -> Result<T>,
    ) {
        let before = bits(&self.batch);
        assert_refused(input(&mut self.env, &mut self.batch), status, culprits);
        assert_eq!(bits(&self.batch), before);
        self.step();
    }
}

#[test]
fn ids() {
    assert_refused(Options::new("Ant-v9"), ErrorKind::Name, &["Ant-v9", "Ant-v4", "mjenv_id_at"]);
    assert_refused(mjenv::spec(""), ErrorKind::Name, &["mjenv_id_at"]);
    assert_refused(Options::new("Ant-v4\0"), ErrorKind::Argument, &[r#""Ant-v4\0""#, "NUL"]);
}

#[test]
fn options() {
    let mut options = Options::new("Ant-v5").unwrap();
    let mut refuses = |name: &str, value: mjenv::Value, status, culprits: &[&str]| {
        let before = format!("{options:?}");
        assert_refused(options.set(name, value).map(|_| ()), status, culprits);
        assert_eq!(format!("{options:?}"), before);
    };
    refuses("healthy_z", 1.0.into(), ErrorKind::Name, &["healthy_z", "Ant-v5", "healthy_z_range"]);
    refuses("a\0b", 1.0.into(), ErrorKind::Argument, &[r#""a\0b""#]);
    refuses("frame_skip", "five".into(), ErrorKind::Type, &["frame_skip", "integer"]);
    refuses("frame_skip", 5.0.into(), ErrorKind::Type, &["frame_skip", "integer"]);
    refuses("xml_file", 5.into(), ErrorKind::Type, &["xml_file", "text"]);
    refuses("terminate_when_unhealthy", 0.5.into(), ErrorKind::Type, &["terminate_when_unhealthy", "flag"]);
    refuses("healthy_z_range", 1.into(), ErrorKind::Type, &["healthy_z_range"]);
    refuses("healthy_z_range", [0.0; 3].into(), ErrorKind::Size, &["healthy_z_range", "2", "3"]);
    refuses("healthy_z_range", Vec::<f64>::new().into(), ErrorKind::Size, &["healthy_z_range", "2", "0"]);
    refuses("frame_skip", 0.into(), ErrorKind::Value, &["frame_skip", "[1, ", "0"]);
    refuses("max_episode_steps", (-1).into(), ErrorKind::Value, &["max_episode_steps", "-1"]);
    refuses("num_threads", (-1).into(), ErrorKind::Value, &["num_threads", "-1"]);
    refuses("num_threads", 1025.into(), ErrorKind::Value, &["num_threads", "1024"]);
    refuses("terminate_when_unhealthy", 2.into(), ErrorKind::Value, &["terminate_when_unhealthy", "2"]);
    refuses("reset_noise_scale", f64::NAN.into(), ErrorKind::Value, &["reset_noise_scale", "nan"]);
    refuses("trust_xml", "never".into(), ErrorKind::Value, &["trust_xml", "never", "auto, yes, no"]);
    refuses("norm", "fuzed".into(), ErrorKind::Value, &["norm", "fuzed", "auto, fused, plain"]);
    refuses("xml_string", "<mujoco>\0</mujoco>".into(), ErrorKind::Argument, &["xml_string", "NUL"]);

    assert_refused(options.get::<f64>("weight"), ErrorKind::Name, &["weight", "ctrl_cost_weight"]);
    assert_refused(options.get::<f64>("healthy_z_range"), ErrorKind::Type, &["healthy_z_range", "f64"]);
    assert_refused(options.get::<bool>("frame_skip"), ErrorKind::Type, &["frame_skip", "bool"]);
    assert!(Env::new(&options, 1).is_ok());
}

#[test]
fn rows() {
    let options = Options::new("Reacher-v4").unwrap();
    assert_refused(Env::new(&options, 0), ErrorKind::Value, &["rows", "0"]);
    assert_refused(Env::new(&options, usize::MAX), ErrorKind::Memory, &["rows"]);
}

#[test]
fn models() {
    let refuses_as = |kind: ErrorKind, id: &str, option: &str, value: &str, culprits: &[&str]| {
        let mut options = Options::new(id).unwrap();
        options.set(option, value).unwrap();
        assert_refused(Env::new(&options, 1), kind, culprits);
    };
    let refuses = |id: &str, option: &str, value: &str, culprits: &[&str]| {
        refuses_as(ErrorKind::Model, id, option, value, culprits);
    };
    refuses_as(ErrorKind::File, "Ant-v5", "xml_file", "/no/such/model.xml", &["/no/such/model.xml"]);
    refuses_as(ErrorKind::File, "Ant-v5", "xml_file", "antt.xml", &["antt.xml", "ant.xml", "reacher.xml"]);
    refuses("Ant-v5", "xml_string", "<mujoco><worldbody>", &["xml_string"]);
    refuses("Ant-v5", "xml_string", "<mujoco><include file='a.xml'/></mujoco>", &["from memory", "trust_xml"]);
    refuses("Ant-v5", "main_body", "nobody", &["nobody", "torso"]);
    refuses("Reacher-v5", "xml_file", "ant.xml", &["Reacher-v5", "ant.xml", "4 positions", "15 positions"]);
    refuses("Humanoid-v5", "xml_file", "swimmer.xml", &["Humanoid-v5", "swimmer.xml", "6 velocities", "5 velocities"]);
    refuses("Pusher-v5", "xml_file", "humanoid.xml", &["Pusher-v5", "tips_arm"]);

    let mut options = Options::new("Ant-v5").unwrap();
    assert_refused(Env::new(options.set("main_body", 99).unwrap(), 1), ErrorKind::Model, &["main_body", "99", "14"]);
    assert!(Env::new(options.set("main_body", 1).unwrap(), 1).is_ok());
}

#[test]
fn steps_out_of_time() {
    let mut options = Options::new("InvertedPendulum-v5").unwrap();
    let mut env = Env::new(options.set("max_episode_steps", 2).unwrap(), 2).unwrap();
    let mut batch = env.batch::<f64>();
    assert_refused(env.step(.., &[0.0f32; 2], &mut batch), ErrorKind::NotReset, &["row 0", "reset"]);
    env.reset(&[true, false], &mut batch).unwrap();
    assert_refused(env.step(.., &[0.0f32; 2], &mut batch), ErrorKind::NotReset, &["row 1", "reset"]);
    env.reset(.., &mut batch).unwrap();
    for _ in 0..2 {
        env.step(.., &[0.0f32; 2], &mut batch).unwrap();
    }
    assert_eq!(batch.truncated(), [true, true]);
    let before = bits(&batch);
    assert_refused(env.step(.., &[0.0f32; 2], &mut batch), ErrorKind::EpisodeEnded, &["row 0", "ended", "strict"]);
    assert_eq!(bits(&batch), before);
    env.reset(.., &mut batch).unwrap();
    env.step(.., &[0.0f32; 2], &mut batch).unwrap();

    let mut free = Env::new(options.set("strict", false).unwrap(), 1).unwrap();
    let mut batch = free.batch::<f64>();
    free.reset(.., &mut batch).unwrap();
    for _ in 0..3 {
        free.step(.., &[f32::NAN], &mut batch).unwrap();
    }
    assert!(batch.ended(0));
}

#[test]
fn actions() {
    let mut pair = Pair::new("HalfCheetah-v4", 2);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut actions = [0.5f32; 12];
        actions[9] = bad;
        pair.refuses(ErrorKind::Value, &["row 1", "action[3]", "strict"], |env, out| env.step(.., &actions, out));
        let wide = actions.map(f64::from);
        pair.refuses(ErrorKind::Value, &["row 1", "action[3]"], |env, out| env.step(.., &wide, out));
    }
    pair.refuses(ErrorKind::Size, &["action", "6", "12"], |env, out| env.step(.., &[0.0f32; 6], out));
    pair.refuses(ErrorKind::Size, &["action", "0", "12"], |env, out| env.step::<f64, _>(.., &[], out));
    pair.refuses(ErrorKind::Size, &["action", "13", "12"], |env, _| env.sample_actions(&mut [0.0; 13]));
}

#[test]
fn outputs_of_another_environment() {
    let mut pair = Pair::new("HalfCheetah-v5", 2);
    let mut options = Options::new("HalfCheetah-v5").unwrap();
    let mut single = Env::new(&options, 1).unwrap().batch::<f64>();
    options.set("exclude_current_positions_from_observation", false).unwrap();
    let mut other = Env::new(&options, 2).unwrap().batch::<f64>();
    let before = (bits(&single), bits(&other));
    pair.refuses(ErrorKind::Size, &["rows", "1", "2"], |env, _| env.step(.., &[0.0f32; 12], &mut single));
    pair.refuses(ErrorKind::Size, &["obs_count", "18", "17"], |env, _| env.step(.., &[0.0f32; 12], &mut other));
    pair.refuses(ErrorKind::Size, &["rows"], |env, _| env.reset(.., &mut single));
    pair.refuses(ErrorKind::Size, &["obs_count"], |env, _| env.observe(&mut other));
    assert_eq!((bits(&single), bits(&other)), before);
    pair.refuses(ErrorKind::Name, &["x_speed", "x_velocity"], |_, out| out.info("x_speed").map(<[f64]>::to_vec));
    pair.refuses(ErrorKind::Name, &["reward_ctrl", "x_position"], |_, out| {
        out.reset_info("reward_ctrl").map(<[f64]>::to_vec)
    });
}

#[test]
fn outputs_without_room_for_arrays_or_reset_infos() {
    let mut options = Options::new("HalfCheetah-v5").unwrap();
    let mut plain = Env::new(&options, 1).unwrap().batch::<f64>();
    let mut env = Env::new(options.set("arrays", "xpos").unwrap(), 1).unwrap();
    let mut batch = env.batch::<f64>();
    env.reset(.., &mut batch).unwrap();
    let needs = ["arrays_count", "0", "24"];
    assert_refused(env.step(.., &[0.0f32; 6], &mut plain), ErrorKind::Size, &needs);
    assert_refused(env.reset(.., &mut plain), ErrorKind::Size, &needs);
    assert_refused(env.reset(&[true], &mut plain), ErrorKind::Size, &needs);
    assert_refused(env.observe(&mut plain), ErrorKind::Size, &needs);
    assert_refused(env.rollout(&[0.0f32; 6], 1, &mut plain), ErrorKind::Size, &needs);
    env.step(.., &[0.0f32; 6], &mut batch).unwrap();
    assert_refused(batch.array("qpos").map(<[f64]>::to_vec), ErrorKind::Name, &["qpos", "xpos"]);
    assert_refused(batch.final_info("x_velocity").map(<[f64]>::to_vec), ErrorKind::Name, &["autoreset_mode"]);

    // These two differ only in their reset infos.
    let old = Env::new(&Options::new("HalfCheetah-v4").unwrap(), 1).unwrap();
    let mut new = Env::new(&Options::new("HalfCheetah-v5").unwrap(), 1).unwrap();
    assert_refused(new.reset(.., &mut old.batch::<f64>()), ErrorKind::Size, &["info_count", "0", "1"]);
    new.reset(.., &mut new.batch::<f64>()).unwrap();
    assert_refused(
        new.step(.., &[0.0f32; 6], &mut old.batch::<f64>()),
        ErrorKind::Size,
        &["reset_info_count", "0", "1"],
    );

    let mut other = Options::new("HalfCheetah-v5").unwrap();
    other.set("arrays", "xposs").unwrap();
    assert_refused(Env::new(&other, 1), ErrorKind::Name, &["arrays", "xposs", "xpos"]);
}

#[test]
fn rollouts() {
    let mut pair = Pair::new("HalfCheetah-v4", 2);
    let mut out = pair.env.rollout_batch::<f64>(3);
    pair.refuses(ErrorKind::Size, &["action", "12", "36"], |env, _| env.rollout(&[0.0f32; 12], 3, &mut out));
    pair.refuses(ErrorKind::Size, &["rows", "2", "6"], |env, batch| env.rollout(&[0.0f32; 36], 3, batch));
    pair.refuses(ErrorKind::Value, &["steps", "0"], |env, _| env.rollout::<f32, _>(&[], 0, &mut out));
    pair.refuses(ErrorKind::Value, &["steps"], |env, _| env.rollout(&[0.0f32; 36], usize::MAX, &mut out));
    pair.refuses(ErrorKind::Value, &["nan"], |env, _| env.rollout(&[f64::NAN; 36], 3, &mut out));
}

#[test]
fn streams_and_simulations() {
    let mut pair = Pair::new("Swimmer-v4", 2);
    pair.refuses(ErrorKind::Value, &["row 2"], |env, _| env.stream(2));
    pair.refuses(ErrorKind::Value, &["increment", "2"], |env, _| env.set_stream(0, &[0, 0, 2, 0, 0, 0]));
    pair.refuses(ErrorKind::Size, &["1", "2"], |env, _| env.simulate(0, &[0.0], 1));
    pair.refuses(ErrorKind::Value, &["frames", "0"], |env, _| env.simulate(0, &[0.0; 2], 0));
    let fresh = Env::new(&Options::new("Swimmer-v4").unwrap(), 1).unwrap();
    assert_refused(fresh.stream(0), ErrorKind::NotReset, &["row 0", "seeded"]);
}

#[test]
fn seeds_and_masks() {
    let mut pair = Pair::new("Swimmer-v5", 2);
    pair.refuses(ErrorKind::Size, &["seeds", "1", "2"], |env, _| env.seed(.., &[1]));
    pair.refuses(ErrorKind::Size, &["seeds", "3", "2"], |env, _| env.seed(&[true; 2], &[1; 3]));
    pair.refuses(ErrorKind::Size, &["mask", "0", "2"], |env, _| env.seed(&[false; 0], &[1; 2]));
    pair.refuses(ErrorKind::Size, &["mask", "1", "2"], |env, out| env.reset(&[true], out));
    pair.refuses(ErrorKind::Size, &["mask", "1", "2"], |env, _| env.seed(&[true], &[1; 2]));
    pair.refuses(ErrorKind::Size, &["seeds", "2", "1"], |env, _| env.seed(0, &[1, 2]));
    pair.refuses(ErrorKind::Size, &["seeds", "1", "2"], |env, _| env.seed(&[1, 0], &[1]));
    pair.refuses(ErrorKind::Size, &["words", "0"], |env, _| env.seed(0, &[[0; 0]]));
    pair.refuses(ErrorKind::Value, &["row 2", "0..1"], |env, _| env.seed(2, &[1]));
    pair.refuses(ErrorKind::Value, &["row 2", "0..1"], |env, _| env.seed(&[0, 2], &[1, 2]));
    pair.refuses(ErrorKind::Value, &["row 2", "0..1"], |env, out| env.reset(2, out));
    pair.refuses(ErrorKind::Size, &["action", "4", "2"], |env, out| env.step(1, &[0.0; 4], out));
    pair.refuses(ErrorKind::Size, &["action", "2", "4"], |env, out| env.step(&[true, false], &[0.0; 2], out));
    pair.refuses(ErrorKind::Value, &["row 7", "0..1"], |env, out| env.step(&[1, 7], &[0.0; 4], out));
    pair.refuses(ErrorKind::Size, &["mask", "3", "2"], |env, _| env.send(&[false; 3], &[0.0; 4]));
    pair.refuses(ErrorKind::Size, &["action", "2", "4"], |env, _| env.send(&[false, true], &[0.0; 2]));
}

#[test]
fn arrays_and_objects() {
    let mut pair = Pair::new("Pusher-v4", 2);
    pair.refuses(ErrorKind::Name, &["xposs", "xpos", "mjenv_field_at"], |env, _| env.read(0, "xposs"));
    pair.refuses(ErrorKind::Argument, &["qpos", "NUL"], |env, _| env.read(0, "qpos\0"));
    pair.refuses(ErrorKind::Value, &["row 2", "0..1"], |env, _| env.read(2, "qpos"));
    pair.refuses(ErrorKind::Value, &["row"], |env, _| env.read(usize::MAX, "qpos"));
    let mut short = [7.0; 3];
    pair.refuses(ErrorKind::Size, &["3", "11"], |env, _| env.read_into(1, "qpos", &mut short));
    assert_eq!(short, [7.0; 3]);
    pair.refuses(ErrorKind::Size, &["0", "11"], |env, _| env.read_into(1, "qpos", &mut []));
    pair.refuses(ErrorKind::Name, &["bodi", "body, joint"], |env, _| env.object_index("bodi", "goal"));
    pair.refuses(ErrorKind::Name, &["bodies", "body, joint"], |env, _| env.object_count("bodies"));
    pair.refuses(ErrorKind::Name, &["gaol", "goal"], |env, _| env.object_index("body", "gaol"));
    pair.refuses(ErrorKind::Value, &["13", "0..12"], |env, _| env.object_name("body", 13).map(|_| ()));
}

#[test]
fn states() {
    let mut pair = Pair::new("Hopper-v4", 2);
    pair.refuses(ErrorKind::Size, &["nq", "5", "6"], |env, _| env.set_state(0, &[0.0; 5], &[0.0; 6]));
    pair.refuses(ErrorKind::Size, &["nv", "0", "6"], |env, _| env.set_state(0, &[0.0; 6], &[]));
    pair.refuses(ErrorKind::Value, &["qvel[2]", "nan"], |env, _| {
        env.set_state(1, &[1.0; 6], &[0.0, 0.0, f64::NAN, 0.0, 0.0, 0.0])
    });
    pair.refuses(ErrorKind::Value, &["qpos[0]", "inf"], |env, _| env.set_state(1, &[f64::INFINITY; 6], &[0.0; 6]));
    pair.refuses(ErrorKind::Value, &["row 2"], |env, _| env.set_state(2, &[0.0; 6], &[0.0; 6]));
}

#[test]
fn writes() {
    let mut pair = Pair::new("Hopper-v4", 2);
    let mass = pair.env.read(0, "body_mass").unwrap();
    let bad = |value| mass.iter().map(|_| value).collect::<Vec<f64>>();
    pair.refuses(ErrorKind::Name, &["body_maas"], |env, _| env.write(0, "body_maas", &[]));
    pair.refuses(ErrorKind::Name, &["xpos", "MuJoCo computes it"], |env, _| env.write(.., "xpos", &[]));
    pair.refuses(ErrorKind::Name, &["body_parentid", "structure"], |env, _| env.write(.., "body_parentid", &[]));
    pair.refuses(ErrorKind::Argument, &["body_mass", "NUL"], |env, _| env.write(0, "body_mass\0", &mass));
    pair.refuses(ErrorKind::Value, &["row 2", "0..1"], |env, _| env.write(2, "body_mass", &mass));
    pair.refuses(ErrorKind::Size, &["body_mass", "4", "5"], |env, _| env.write(1, "body_mass", &mass[..4]));
    pair.refuses(ErrorKind::Size, &["body_mass"], |env, _| env.write(1, "body_mass", &[]));
    pair.refuses(ErrorKind::Size, &["body_mass", "7", "5 (the same in all rows) or 10 (5 for each row)"], |env, _| {
        env.write(.., "body_mass", &[&mass[..], &mass[..2]].concat())
    });
    pair.refuses(ErrorKind::Size, &["body_mass", "10", "5"], |env, _| env.write(1, "body_mass", &mass.repeat(2)));
    pair.refuses(ErrorKind::Size, &["body_mass", "6", "10"], |env, _| env.write(&[1, 0], "body_mass", &[1.0; 6]));
    pair.refuses(ErrorKind::Value, &["row 2", "0..1"], |env, _| env.write(&[1, 2], "body_mass", &mass));
    pair.refuses(ErrorKind::Size, &["mask", "1", "2"], |env, _| env.write(&[true], "body_mass", &mass));
    pair.refuses(ErrorKind::Value, &["body_mass[0]", "nan"], |env, _| env.write(0, "body_mass", &bad(f64::NAN)));
    pair.refuses(ErrorKind::Value, &["body_mass", "-1"], |env, _| env.write(.., "body_mass", &bad(-1.0)));
    let half_bad = [&mass[..], &bad(-1.0)].concat();
    pair.refuses(ErrorKind::Value, &["body_mass", "-1"], |env, _| env.write(.., "body_mass", &half_bad));
    pair.refuses(ErrorKind::Value, &["row 2"], |env, _| env.set_constants(2));
}

#[test]
fn images() {
    let mut pair = Pair::new("HalfCheetah-v4", 2);
    let image = pair.env.snapshot(0).unwrap();
    let other = Env::new(&Options::new("Ant-v5").unwrap(), 1).unwrap();
    let foreign = other.snapshot(0).unwrap();
    pair.refuses(ErrorKind::Snapshot, &["0 bytes", "short"], |env, _| env.restore(0, &[]));
    pair.refuses(ErrorKind::Snapshot, &["not an image"], |env, _| env.restore(0, &[0x5a; 4096]));
    pair.refuses(ErrorKind::Snapshot, &["HalfCheetah-v4"], |env, _| env.restore(0, &foreign));
    pair.refuses(ErrorKind::Snapshot, &["damaged"], |env, _| env.restore(1, &image[..image.len() - 1]));
    pair.refuses(ErrorKind::Value, &["row 2"], |env, _| env.restore(2, &image));
    pair.refuses(ErrorKind::Value, &["row 9"], |env, _| env.snapshot(9));
    pair.refuses(ErrorKind::Snapshot, &["1 row(s)", "2"], |env, _| env.restore(.., &image));
    let all = pair.env.snapshot(..).unwrap();
    pair.refuses(ErrorKind::Argument, &["one row or all"], |env, _| env.snapshot(&[true, false]));
    pair.refuses(ErrorKind::Argument, &["one row or all"], |env, _| env.restore(&[0], &image));
    pair.refuses(ErrorKind::Snapshot, &["2 row(s)", "1"], |env, _| env.restore(0, &all));
    pair.refuses(ErrorKind::Value, &["row 2"], |env, _| env.copy_row(2, &[true; 2]));
    pair.refuses(ErrorKind::Size, &["mask", "1", "2"], |env, _| env.copy_row(0, &[true]));
    for position in (0..image.len()).step_by(image.len() / 40) {
        let mut damaged = image.clone();
        damaged[position] ^= 0x10;
        pair.refuses(ErrorKind::Snapshot, &[], |env, _| env.restore(0, &damaged));
    }
}
