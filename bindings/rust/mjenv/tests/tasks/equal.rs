//! Compares Hopper-v5, written again in Rust, with the built-in one in every bit.

use mjenv::{Batch, Env, Field, Options, Real, Role};

const ROWS: usize = 64;

/// What is set in both environments.
#[derive(Clone, Copy)]
struct Setting {
    threads: i64,
    autoreset: &'static str,
    /// Options of the task, too.
    changed: bool,
}

fn env_of(id: &str, setting: Setting) -> Env {
    let mut options = Options::new(id).unwrap();
    options.set("num_threads", setting.threads).unwrap().set("autoreset_mode", setting.autoreset).unwrap();
    if setting.changed {
        options.set("healthy_reward", 2).unwrap().set("exclude_current_positions_from_observation", false).unwrap();
        options.set("frame_skip", 3).unwrap().set("max_episode_steps", 20).unwrap();
        options.set("ctrl_cost_weight", 0.25).unwrap().set("reset_noise_scale", 0.02).unwrap();
    }
    Env::new(&options, ROWS).unwrap()
}

struct Pair {
    envs: [Env; 2],
    batches: [Batch; 2],
}

pub fn assert_bits(what: &str, [expected, found]: [&[f64]; 2]) {
    let same = expected.iter().map(|value| value.to_bits()).eq(found.iter().map(|value| value.to_bits()));
    assert!(same, "{what}: {found:?}, not {expected:?}");
}

impl Pair {
    fn new(own: &str, setting: Setting) -> Self {
        let mut envs = ["Hopper-v5", own].map(|id| env_of(id, setting));
        let mut batches = [envs[0].batch::<f64>(), envs[1].batch::<f64>()];
        for (env, batch) in envs.iter_mut().zip(&mut batches) {
            env.seed(.., &(7..7 + ROWS as u64).collect::<Vec<_>>()).unwrap();
            env.reset(.., batch).unwrap();
        }
        Self { envs, batches }
    }

    fn step<A: Real>(&mut self, actions: &[A]) {
        for (env, batch) in self.envs.iter_mut().zip(&mut self.batches) {
            env.step(.., actions, batch).unwrap();
        }
    }

    fn assert_equal(&self, step: usize) {
        let [a, b] = &self.batches;
        assert_bits(&format!("observations of step {step}"), [a.observations(), b.observations()]);
        assert_bits(&format!("rewards of step {step}"), [a.reward(), b.reward()]);
        assert_eq!((a.terminated(), a.truncated()), (b.terminated(), b.truncated()), "step {step}");
        assert_eq!(a.was_reset(), b.was_reset(), "step {step}");
        let infos = |batch: &Batch| batch.infos().chain(batch.reset_infos()).count();
        assert_eq!(infos(a), infos(b));
        for ((name, a), (same, b)) in a.infos().chain(a.reset_infos()).zip(b.infos().chain(b.reset_infos())) {
            assert_eq!(name, same);
            assert_bits(name, [a, b]);
        }
        for row in 0..ROWS {
            assert_eq!(a.final_obs(row).is_some(), b.final_obs(row).is_some());
            assert_bits("final_obs", [a.final_obs(row).unwrap_or(&[]), b.final_obs(row).unwrap_or(&[])]);
        }
    }
}

/// Actions in [-1, 1) that differ by row and step.
fn actions(pair: &Pair, step: usize) -> Vec<f64> {
    let count = ROWS * pair.envs[0].action_space().count();
    (0..count).map(|i| ((7919 * (i + count * step) + 13) % 2003) as f64 / 1001.0 - 1.0).collect()
}

fn play(own: &str, setting: Setting, steps: usize, single: bool) {
    let mut pair = Pair::new(own, setting);
    pair.assert_equal(0);
    let mut ends = 0;
    for step in 0..steps {
        let wide = actions(&pair, step);
        if single {
            pair.step(&wide.iter().map(|&value| value as f32).collect::<Vec<_>>());
        } else {
            pair.step(&wide);
        }
        pair.assert_equal(step);
        ends += (0..ROWS).filter(|&row| pair.batches[0].ended(row)).count();
    }
    assert!(ends > ROWS);
}

pub fn one_thread(own: &str) {
    play(own, Setting { threads: 1, autoreset: "next_step", changed: false }, 1000, true);
}

pub fn two_threads(own: &str) {
    play(own, Setting { threads: 2, autoreset: "same_step", changed: false }, 1000, false);
}

pub fn five_threads(own: &str) {
    play(own, Setting { threads: 5, autoreset: "next_step", changed: false }, 1000, false);
}

pub fn changed_options(own: &str) {
    for single in [false, true] {
        play(own, Setting { threads: 2, autoreset: "same_step", changed: true }, 60, single);
    }
}

/// The carried number is part of a row: snapshots save it, and it follows a change of the state.
pub fn states(own: &str) {
    let setting = Setting { threads: 2, autoreset: "disabled", changed: false };
    let mut pair = Pair::new(own, setting);
    (0..5).for_each(|step| pair.step(&actions(&pair, step)));
    let image = pair.envs[1].snapshot(..).unwrap();
    pair.envs[1] = env_of(own, Setting { threads: 5, ..setting });
    pair.envs[1].restore(.., &image).unwrap();
    pair.step(&actions(&pair, 5));
    pair.assert_equal(5);

    let mask: Vec<_> = (0..ROWS).map(|row| row % 3 == 0).collect();
    for env in &mut pair.envs {
        env.copy_row(4, &mask).unwrap();
        let (mut qpos, qvel) = (env.read(10, "qpos").unwrap(), env.read(10, "qvel").unwrap());
        qpos[0] += 0.25;
        env.set_state(7, &qpos, &qvel).unwrap();
    }
    pair.step(&actions(&pair, 6));
    pair.assert_equal(6);
}

pub fn descriptions(own: &str) {
    let setting = Setting { threads: 1, autoreset: "disabled", changed: false };
    let [built_in, repeated] = ["Hopper-v5", own].map(|id| env_of(id, setting));
    let (expected, found) = (built_in.spec(), repeated.spec());
    assert_eq!((found.id, found.version), (own, 5));
    assert_eq!(found.max_episode_steps, expected.max_episode_steps);
    assert_eq!(found.reward_threshold, expected.reward_threshold);
    assert_eq!(repeated.frame_skip(), built_in.frame_skip());
    assert_eq!(repeated.action_space(), built_in.action_space());
    assert_eq!(repeated.observation_space(), built_in.observation_space());
    let options = |env: &Env| format!("{:?}", env.options().schema().collect::<Vec<_>>());
    assert_eq!(options(&repeated), options(&built_in));
    for role in [Role::Observation, Role::Info, Role::ResetInfo, Role::Reward, Role::Structure] {
        let [a, b]: [Vec<Field>; 2] = [built_in.fields(role).collect(), repeated.fields(role).collect()];
        assert_eq!(a, b);
    }
}
