//! What only the library on MuJoCo 4.0 does. tests/mujoco4 compares its episodes with Gymnasium's.
#![cfg(feature = "mujoco4")]

use mjenv::{Env, ErrorKind, Options};

#[test]
fn the_version_names_the_engine() {
    assert!(mjenv::version().contains("(MuJoCo 4.0"), "{}", mjenv::version());
}

/// MuJoCo is opened once in a process, so this is one test.
#[test]
fn mujoco_is_opened_when_it_is_first_needed() {
    let given = std::env::var("MJENV_MUJOCO").expect("tests/mujoco4 sets it");
    let options = Options::new("Hopper-v5").unwrap();
    for wrong in ["/dev/null", "/nowhere/libmujoco.so.4.0.0"] {
        std::env::set_var("MJENV_MUJOCO", wrong);
        let error = Env::new(&options, 1).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::File);
        for words in ["MJENV_MUJOCO", wrong, "mujoco-core"] {
            assert!(error.to_string().contains(words), "{error}");
        }
    }
    std::env::set_var("MJENV_MUJOCO", given);
    let mut env = Env::new(&options, 1).unwrap();
    let mut batch = env.batch::<f64>();
    env.seed(.., &[1]).unwrap();
    env.reset(.., &mut batch).unwrap();
    env.step(.., &[0.0; 3], &mut batch).unwrap();
    let image = env.snapshot(0).unwrap();
    env.restore(0, &image).unwrap();
}
