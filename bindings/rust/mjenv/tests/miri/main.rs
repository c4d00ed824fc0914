//! Miri checks the crate's own use of pointers and threads. `tests/run miri` runs this.
#![cfg(miri)]

mod fake;

use std::thread;

use mjenv::{Env, ErrorKind, Options, Role};

fn env(rows: usize) -> Env {
    Env::new(&Options::new("Fake-v5").unwrap(), rows).unwrap()
}

#[test]
fn options() {
    let mut options = Options::new("Fake-v5").unwrap();
    options.set("num_threads", 3).unwrap().set("range", [0.0, 2.0]).unwrap();
    options.set("autoreset_mode", "disabled").unwrap();
    assert_eq!(options.get::<i64>("num_threads").unwrap(), 3);
    assert_eq!(options.get::<Vec<f64>>("range").unwrap(), [0.0, 2.0]);
    assert_eq!(options.get::<String>("autoreset_mode").unwrap(), "disabled");
    let names: Vec<_> = options.schema().map(|option| option.name).collect();
    assert_eq!(names, ["num_threads", "strict", "range", "autoreset_mode"]);
    let error = options.set("nothing", 1).unwrap_err();
    assert_eq!((error.kind(), error.message()), (ErrorKind::Name, "no such thing"));
    let copy = options.clone();
    drop(options);
    assert!(format!("{copy:?}").contains("disabled"));
}

#[test]
fn an_environment_and_what_it_lends() {
    let mut env = env(3);
    let (space, options) = (env.action_space(), env.options());
    assert_eq!((space.count(), space.low[1]), (2, 1.0));
    assert_eq!(options.get::<i64>("num_threads").unwrap(), 1);
    assert_eq!(env.fields(Role::Info).map(|field| field.name).collect::<Vec<_>>(), ["place", "speed"]);
    assert_eq!(env.object_name("body", 1).unwrap(), "torso\u{fffd}");
    assert_eq!(env.read(2, "qpos").unwrap(), [2.0; 3]);
    assert_eq!(env.read_into(1, "qpos", &mut [0.0; 3]).unwrap(), 3);
    let mut actions = [0.0; 6];
    env.sample_actions(&mut actions).unwrap();
    assert_eq!(actions, [0.5; 6]);
}

#[test]
fn steps() {
    let mut env = env(3);
    let (mut batch, mut rounded) = (env.batch::<f64>(), env.batch::<f32>());
    env.reset(.., &mut batch).unwrap();
    env.step(.., &[1.0f64, 0.0, 0.5, 0.5, 2.0, 2.0], &mut batch).unwrap();
    assert_eq!(batch.observations(), [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 4.0, 4.0, 4.0]);
    assert_eq!(
        (batch.info("place").unwrap(), batch.info("speed").unwrap()),
        (&[1.0, 1.0, 1.0, 1.0, 4.0, 4.0][..], &[1.0, 1.0, 4.0][..])
    );
    assert_eq!((batch.ended(2), batch.failed(2), batch.final_obs(2)), (true, false, Some(&[4.0; 3][..])));
    let kept = batch.clone();
    env.reset(&[false, false, true], &mut batch).unwrap();
    env.step(.., &[1.0f32; 6], &mut rounded).unwrap();
    assert_eq!(rounded.obs(2), [2.0f32; 3]);
    assert_eq!(kept.obs(2), [4.0; 3]);
    assert_eq!(env.step(.., &[0.0f32; 5], &mut batch).unwrap_err().kind(), ErrorKind::Size);
    let image = env.snapshot(0).unwrap();
    env.restore(1, &image).unwrap();
    assert_eq!(env.restore(1, &image[1..]).unwrap_err().kind(), ErrorKind::Snapshot);
}

/// The actions of some rows are put at their places.
#[test]
fn some_rows() {
    let mut env = env(4);
    let (mut batch, mut rows) = (env.batch::<f64>(), Vec::new());
    env.reset(.., &mut batch).unwrap();
    env.step(&[3, 1], &[1.0f32, 0.5, 2.0, 0.25], &mut batch).unwrap();
    assert_eq!([0, 1, 2, 3].map(|row| batch.obs(row)[0]), [0.0, 2.25, 0.0, 1.5]);
    env.step(1, &[1.0f64, 1.0], &mut batch).unwrap();
    env.step(&[false, false, true, false], &[8.0f32; 8], &mut batch).unwrap();
    assert_eq!([0, 1, 2, 3].map(|row| batch.obs(row)[0]), [0.0, 4.25, 16.0, 1.5]);
    env.send(&[true, false, false, true], &[1.0f32, 1.0, 9.0, 9.0, 9.0, 9.0, 2.0, 2.0]).unwrap();
    env.send(&[2, 1], &[0.5f64, 0.0, 0.25, 0.0]).unwrap();
    env.recv(4, None, &mut rows, &mut batch).unwrap();
    assert_eq!(rows, [0, 3, 2, 1]);
    assert_eq!([0, 1, 2, 3].map(|row| batch.obs(row)[0]), [2.0, 4.5, 16.5, 5.5]);
    env.reset(&[0, 3], &mut batch).unwrap();
    assert_eq!(env.step(&[4], &[0.0; 2], &mut batch).unwrap_err().kind(), ErrorKind::Value);
    assert_eq!(env.step(&[true], &[0.0; 8], &mut batch).unwrap_err().kind(), ErrorKind::Size);
}

#[test]
fn an_environment_moves_between_threads() {
    let mut env = env(2);
    let mut batch = env.batch::<f64>();
    env.reset(.., &mut batch).unwrap();
    let (env, batch) = thread::spawn(move || {
        env.step(.., &[1.0f32; 4], &mut batch).unwrap();
        (env, batch)
    })
    .join()
    .unwrap();
    drop(env);
    assert_eq!(batch.obs(1), [2.0; 3]);
}

/// Rows are read while others are under way.
#[test]
fn rows_under_way() {
    let mut env = env(4);
    let (mut batch, mut rows) = (env.batch::<f64>(), Vec::new());
    env.reset(.., &mut batch).unwrap();
    env.send(.., &[0.5f32; 8]).unwrap();
    for round in 0..6 {
        env.recv(1 + round % 2, None, &mut rows, &mut batch).unwrap();
        assert_eq!(rows.len(), 1 + round % 2);
        for &row in &rows {
            let reward = batch.reward()[row];
            assert_eq!(batch.obs(row), [reward; 3]);
            assert_eq!(batch.info("place").unwrap()[2 * row..][..2], [reward; 2]);
        }
        env.send(&rows, &vec![0.5f64; 2 * rows.len()]).unwrap();
    }
    assert_eq!(env.send(&[0], &[0.0f32; 2]).unwrap_err().kind(), ErrorKind::Pending);
}

#[test]
fn dropped_under_way() {
    let mut env = env(3);
    env.send(.., &[0.5f32; 6]).unwrap();
}

/// Rows that failed are received, too.
#[test]
fn rows_that_fail_for_want_of_memory() {
    let mut options = Options::new("Fake-v5").unwrap();
    options.set("num_threads", fake::SHORT_OF_MEMORY).unwrap();
    let mut env = Env::new(&options, 2).unwrap();
    let (mut batch, mut rows) = (env.batch::<f64>(), Vec::new());
    for _ in 0..2 {
        env.send(.., &[0.0f32; 4]).unwrap();
        assert_eq!(env.recv(2, None, &mut rows, &mut batch).unwrap_err().kind(), ErrorKind::Memory);
        assert_eq!(rows, [0, 1]);
    }
}
