//! Resets that draw models, and noise, delays and pushes. tests/live compares the draws with Gymnasium's.

use mjenv::{Env, ErrorKind, Options};

use crate::golden::assert_bits;

const DOCUMENT: &str = r#"{
    "randomize": {
        "body_mass": {"kind": "scale", "low": 0.5, "high": 1.5, "elements": [1, 2], "set_constants": true},
        "geom_friction": {"kind": "scale", "distribution": "log_uniform", "low": 0.5, "high": 2, "shared": true},
        "opt.timestep": {"choices": [0.001, 0.002]}
    },
    "noise": {"action": 0.1, "observation": 0.01},
    "delay": {"action": [1, 2], "observation": 2, "first_action": 0.2},
    "push": {"body": "torso", "every": 1, "force": [[-1, 1], [-1, 1], [-1, 1]], "torque": [[-1, 1], [-1, 1], [-1, 1]]}
}"#;

fn hopper(rows: usize) -> Env {
    let mut env = Env::new(&Options::new("Hopper-v5").unwrap(), rows).unwrap();
    env.randomize(DOCUMENT).unwrap();
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
    let ahead = "[[5, 5], [0, 0], [0, 0]]";
    let kick = format!(r#"{{"body": 1, "every": 5, "velocity": {ahead}}}"#);
    let force = format!(r#"{{"body": 1, "every": 1, "duration": 3, "force": {ahead}}}"#);
    env.randomize(&format!(r#"{{"push": [{force}, {kick}]}}"#)).unwrap();
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
    let error = env.randomize(&format!(r#"{{"push": [{kick}, {kick}]}}"#)).unwrap_err();
    assert!(error.to_string().contains("twice"), "{error}");
}

#[test]
fn several_arrays_take_one_draw_from_ranges_of_rows() {
    let mut env = Env::new(&Options::new("Hopper-v5").unwrap(), 3).unwrap();
    let gain = r#""actuator_gainprm": {"low": 20, "high": 40, "columns": 0}"#;
    let bias = r#""actuator_biasprm": {"kind": "same", "factor": -1, "columns": 1}"#;
    env.randomize(&format!(r#"{{"randomize": {{{gain}, {bias}}}}}"#)).unwrap();
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
    assert!(env.randomization().unwrap().contains(r#""choices":[0.001,0.002]"#));
    env.randomize(r#"{"randomize": null, "noise": null, "delay": null, "push": null}"#).unwrap();
    assert_eq!(env.randomization().unwrap(), "{}");
    assert_eq!(env.restore(0, &image).unwrap_err().kind(), ErrorKind::Snapshot);
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let mut env = hopper(1);
    let mut refused = |document: &str| env.randomize(document).unwrap_err();
    let unknown = refused(r#"{"randomize": {"body_maas": {"low": 1, "high": 2}}}"#);
    assert_eq!(unknown.kind(), ErrorKind::Name);
    assert!(unknown.to_string().contains("randomize.body_maas"));
    assert_eq!(refused(r#"{"randomize": {"body_mass": {"low": 2, "high": 1}}}"#).kind(), ErrorKind::Value);
    assert_eq!(refused(r#"{"noise": {"action": [0.1, 0.1]}}"#).kind(), ErrorKind::Size);
    assert_eq!(refused("{\0}").kind(), ErrorKind::Argument);
    assert_eq!(refused("{").kind(), ErrorKind::Value);
}
