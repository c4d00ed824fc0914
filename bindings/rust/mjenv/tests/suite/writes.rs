//! Tests rows with models and inputs of their own.

use mjenv::{Env, ErrorKind, Options};

use crate::golden::assert_bits;

const ARRAYS: [&str; 2] = ["body_mass", "body_inertia"];

/// A box that slides and turns above a floor, with a mass.
fn with_mass(mass: f64, rows: usize) -> Env {
    let model = format!(
        r#"<mujoco><option timestep="0.01"/><worldbody><geom type="plane" size="9 9 1"/><body pos="0 0 .4">
<joint name="x" type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 1 0"/>
<geom type="box" size=".3 .3 .3" mass="{mass}"/></body></worldbody>
<actuator><motor joint="x" gear="50"/></actuator></mujoco>"#
    );
    let mut options = Options::new("HalfCheetah-v5").unwrap();
    options.set("xml_string", model.as_str()).unwrap().set("num_threads", rows.min(2)).unwrap();
    let mut env = Env::new(&options, rows).unwrap();
    env.seed(.., &(0..rows as u64).collect::<Vec<_>>()).unwrap();
    env
}

/// Each row computes what an environment of one row computes whose model file has the row's mass.
fn assert_has_masses(env: &mut Env, masses: &[f64]) {
    let mut batch = env.batch::<f64>();
    env.seed(.., &vec![7; masses.len()]).unwrap();
    env.reset(.., &mut batch).unwrap();
    let mut singles: Vec<_> = masses.iter().map(|mass| with_mass(*mass, 1)).collect();
    for single in &mut singles {
        let mut out = single.batch::<f64>();
        single.seed(.., &[7]).unwrap();
        single.reset(.., &mut out).unwrap();
    }
    for step in 0..30 {
        env.step(.., &vec![0.7f32; masses.len()], &mut batch).unwrap();
        for (row, single) in singles.iter_mut().enumerate() {
            let mut out = single.batch::<f64>();
            single.step(.., &[0.7f32], &mut out).unwrap();
            assert_bits(&format!("row {row} step {step}"), batch.obs(row), out.obs(0));
        }
    }
}

#[test]
fn a_row_with_another_mass_is_an_environment_with_that_mass() {
    let (mut env, heavy, light) = (with_mass(3.0, 3), with_mass(8.0, 1), with_mass(0.5, 1));
    assert_has_masses(&mut env, &[3.0, 3.0, 3.0]);
    for array in ARRAYS {
        env.write(1, array, &heavy.read(0, array).unwrap()).unwrap();
    }
    env.set_constants(1).unwrap();
    assert_has_masses(&mut env, &[3.0, 8.0, 3.0]);
    for array in ARRAYS {
        env.write(.., array, &light.read(0, array).unwrap()).unwrap();
    }
    env.set_constants(..).unwrap();
    assert_has_masses(&mut env, &[0.5, 0.5, 0.5]);
}

#[test]
fn many_rows_are_written_at_once() {
    let (mut env, heavy, light) = (with_mass(3.0, 3), with_mass(8.0, 1), with_mass(0.5, 1));
    for array in ARRAYS {
        let [own, heavy, light] = [&env, &heavy, &light].map(|env| env.read(0, array).unwrap());
        env.write(.., array, &[&light[..], &own, &heavy].concat()).unwrap();
    }
    env.set_constants(..).unwrap();
    assert_has_masses(&mut env, &[0.5, 3.0, 8.0]);
    for array in ARRAYS {
        let values = heavy.read(0, array).unwrap().repeat(3);
        env.write(&[true, false, false], array, &values).unwrap();
    }
    env.set_constants(..).unwrap();
    assert_has_masses(&mut env, &[8.0, 3.0, 8.0]);
    let image = env.snapshot(2).unwrap();
    let mut other = with_mass(3.0, 1);
    other.restore(0, &image).unwrap();
    assert_has_masses(&mut other, &[8.0]);
    env.copy_row(1, &[true, true, false]).unwrap();
    assert_has_masses(&mut env, &[3.0, 3.0, 8.0]);
}

#[test]
fn a_reset_clears_inputs_and_keeps_the_model() {
    let mut env = Env::new(&Options::new("Reacher-v5").unwrap(), 2).unwrap();
    let mut batch = env.batch::<f64>();
    env.write(1, "opt.timestep", &[0.005]).unwrap();
    env.reset(.., &mut batch).unwrap();
    env.write(1, "qfrc_applied", &[1.0; 4]).unwrap();
    assert_eq!(env.read(1, "qfrc_applied").unwrap(), [1.0; 4]);
    assert_eq!(env.read(0, "qfrc_applied").unwrap(), [0.0; 4]);
    env.reset(.., &mut batch).unwrap();
    assert_eq!(env.read(1, "qfrc_applied").unwrap(), [0.0; 4]);
    assert_eq!([0, 1].map(|row| env.read(row, "opt.timestep").unwrap()[0]), [0.01, 0.005]);
}

/// While rows are under way, nothing can be written.
#[test]
fn rows_under_way_are_not_written() {
    let mut env = Env::new(&Options::new("Reacher-v5").unwrap(), 2).unwrap();
    let (mut batch, mut rows) = (env.batch::<f64>(), Vec::new());
    env.reset(.., &mut batch).unwrap();
    env.send(.., &[0.0f32; 4]).unwrap();
    assert_eq!(env.write(0, "opt.timestep", &[0.005]).unwrap_err().kind(), ErrorKind::Pending);
    assert_eq!(env.set_constants(0).unwrap_err().kind(), ErrorKind::Pending);
    env.recv(2, None, &mut rows, &mut batch).unwrap();
    env.write(0, "opt.timestep", &[0.005]).unwrap();
}
