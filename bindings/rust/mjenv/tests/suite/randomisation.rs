//! Resets that draw models, and noise, delays and pushes. tests/live compares the draws with Gymnasium's.

use mjenv::{Distribution, Effect, Env, ErrorKind, Options, Perturbation, Push, Randomization};

use crate::golden::assert_bits;

fn items() -> Vec<Randomization> {
    let choice = Distribution::Choice(vec![0.001, 0.002]);
    let mut mass = Randomization::new("body_mass", Effect::Scale, Distribution::Uniform { low: 0.5, high: 1.5 });
    mass.elements = Some(vec![1, 2]);
    mass.constants = true;
    let mut friction =
        Randomization::new("geom_friction", Effect::Scale, Distribution::LogUniform { low: 0.5, high: 2.0 });
    friction.shared = true;
    vec![mass, friction, Randomization::new("opt.timestep", Effect::Value, choice)]
}

fn perturbation() -> Perturbation {
    let push = Push { body: 1, every: (1, 1), low: [-1.0; 6], high: [1.0; 6], ..Default::default() };
    Perturbation {
        action_noise: vec![0.1],
        observation_noise: vec![0.01],
        action_delay: 1,
        observation_delay: 2,
        pushes: vec![push],
        first_action: vec![0.2],
        max_action_delay: 2,
        ..Default::default()
    }
}

fn hopper(rows: usize) -> Env {
    let mut env = Env::new(&Options::new("Hopper-v5").unwrap(), rows).unwrap();
    env.randomize(&items()).unwrap();
    env.perturb(&perturbation()).unwrap();
    env.seed(.., &(3..3 + rows as u64).collect::<Vec<_>>()).unwrap();
    env
}

#[test]
fn rows_draw_as_environments_of_one_row() {
    let (mut many, mut one) = (hopper(2), hopper(1));
    let own = Env::new(&Options::new("Hopper-v5").unwrap(), 1).unwrap().read(0, "body_mass").unwrap();
    let (mut batch, mut out) = (many.batch::<f64>(), one.batch::<f64>());
    many.reset(.., &mut batch).unwrap();
    one.reset(.., &mut out).unwrap();
    for step in 0..8 {
        assert_bits(&format!("step {step}"), batch.obs(0), out.obs(0));
        many.step(.., &[0.1f32; 6], &mut batch).unwrap();
        one.step(.., &[0.1f32; 3], &mut out).unwrap();
    }
    let mass = many.read(1, "body_mass").unwrap();
    assert!((1..3).all(|i| mass[i] != own[i] && mass[i] / own[i] >= 0.5 && mass[i] / own[i] <= 1.5));
    assert_eq!(mass[3..], own[3..]);
    assert!([0.001, 0.002].contains(&many.read(1, "opt.timestep").unwrap()[0]));
    assert!(many.read(1, "xfrc_applied").unwrap()[6] != 0.0);
    // An image goes on where the row was.
    let image = many.snapshot(0).unwrap();
    one.restore(0, &image).unwrap();
    assert_eq!(one.read(0, "geom_friction").unwrap(), many.read(0, "geom_friction").unwrap());
}

#[test]
fn forces_last_and_kicks_change_velocities() {
    let mut env = Env::new(&Options::new("Ant-v5").unwrap(), 1).unwrap();
    let values = [5.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let push = |every, is_kick, duration| Push { body: 1, every, low: values, high: values, is_kick, duration };
    let (force, kick) = (push((1, 1), false, (3, 3)), push((5, 5), true, (0, 0)));
    env.perturb(&Perturbation { pushes: vec![force, kick], ..Default::default() }).unwrap();
    env.seed(.., &[3]).unwrap();
    let mut batch = env.batch::<f64>();
    env.reset(.., &mut batch).unwrap();
    let mut speeds = Vec::new();
    for _ in 0..5 {
        env.step(.., &[0.0; 8], &mut batch).unwrap();
        assert_eq!(env.read(0, "xfrc_applied").unwrap()[6], 5.0);
        speeds.push(env.read(0, "qvel").unwrap()[0]);
    }
    assert!(speeds[3] < 2.0 && speeds[4] > 2.0, "{speeds:?}");
    let twice = vec![Push { body: 1, every: (1, 1), is_kick: true, ..Default::default() }; 2];
    let error = env.perturb(&Perturbation { pushes: twice, ..Default::default() }).unwrap_err();
    assert!(error.to_string().contains("twice"), "{error}");
}

#[test]
fn several_arrays_take_one_draw_from_ranges_of_rows() {
    let mut env = Env::new(&Options::new("Hopper-v5").unwrap(), 3).unwrap();
    let mut gain =
        Randomization::new("actuator_gainprm", Effect::Value, Distribution::Uniform { low: 20.0, high: 40.0 });
    gain.elements = Some(vec![0, 10, 20]);
    let mut bias = Randomization::same("actuator_biasprm", Effect::Value, -1.0);
    bias.elements = Some(vec![1, 11, 21]);
    env.randomize(&[gain, bias]).unwrap();
    env.seed(.., &[1, 2, 3]).unwrap();
    env.write(&[1], "draws[0]", &[50.0, 60.0]).unwrap();
    assert_eq!(env.read(1, "draws[0]").unwrap(), [50.0, 60.0]);
    let mut batch = env.batch::<f64>();
    env.reset(.., &mut batch).unwrap();
    for row in 0..3 {
        let (low, high) = if row == 1 { (50.0, 60.0) } else { (20.0, 40.0) };
        let (gain, bias) = (env.read(row, "actuator_gainprm").unwrap(), env.read(row, "actuator_biasprm").unwrap());
        assert!((0..3).all(|i| gain[10 * i] == -bias[10 * i + 1] && (low..=high).contains(&gain[10 * i])));
    }
    let error = env.write(&[2], "draws[0]", &[2.0, 1.0]).unwrap_err();
    assert!(error.kind() == ErrorKind::Value && error.message().contains("row 2: draws[0]"), "{error}");
}

#[test]
fn settings_are_replaced() {
    let mut env = hopper(1);
    let image = env.snapshot(0).unwrap();
    env.randomize(&[]).unwrap();
    env.perturb(&Perturbation::default()).unwrap();
    assert_eq!(env.restore(0, &image).unwrap_err().kind(), ErrorKind::Snapshot);
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let mut env = hopper(1);
    let refused = |env: &mut Env, array: &str, distribution| {
        env.randomize(&[Randomization::new(array, Effect::Scale, distribution)]).unwrap_err()
    };
    let uniform = |low, high| Distribution::Uniform { low, high };
    let unknown = refused(&mut env, "body_maas", uniform(1.0, 2.0));
    assert_eq!(unknown.kind(), ErrorKind::Name);
    assert!(unknown.to_string().contains("body_maas"));
    assert_eq!(refused(&mut env, "body_mass", uniform(2.0, 1.0)).kind(), ErrorKind::Value);
    assert_eq!(refused(&mut env, "body_mass", uniform(-1.0, 1.0)).kind(), ErrorKind::Value);
    assert_eq!(refused(&mut env, "body_mass", Distribution::Choice(vec![])).kind(), ErrorKind::Size);
    let normal = Distribution::TruncatedNormal { mean: 0.0, std: 1.0, low: 20.0, high: 30.0 };
    assert_eq!(refused(&mut env, "body_mass", normal).kind(), ErrorKind::Value);
    let far = Perturbation { action_delay: usize::MAX, ..Perturbation::default() };
    assert_eq!(env.perturb(&far).unwrap_err().kind(), ErrorKind::Value);
    let noise = Perturbation { action_noise: vec![0.1, 0.1], ..Perturbation::default() };
    assert_eq!(env.perturb(&noise).unwrap_err().kind(), ErrorKind::Size);
}
