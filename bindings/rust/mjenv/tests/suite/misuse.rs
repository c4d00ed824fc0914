//! Tests panics, leaks, and drops at the wrong time. src/misuse.rs has the misuse that the compiler refuses.

use std::mem;
use std::panic::{self, AssertUnwindSafe};
use std::sync::{Arc, Mutex};
use std::thread;

use mjenv::{Env, ErrorKind, Options};

fn env_of(id: &str, rows: usize, threads: i64) -> Env {
    let mut options = Options::new(id).unwrap();
    options.set("num_threads", threads).unwrap();
    Env::new(&options, rows).unwrap()
}

#[test]
fn a_panic_frees_what_it_unwinds() {
    for threads in [1, 2] {
        for _ in 0..20 {
            let caught = panic::catch_unwind(|| {
                let mut env = env_of("Reacher-v5", 4, threads);
                let mut batch = env.batch::<f64>();
                env.reset(.., &mut batch).unwrap();
                assert!(batch.obs(0).is_empty(), "a panic while the environment is alive");
            });
            assert!(caught.is_err());
        }
    }
}

#[test]
fn an_environment_goes_on_after_a_panic() {
    let mut env = env_of("Hopper-v5", 1, 1);
    let mut batch = env.batch::<f64>();
    env.seed(.., &[3]).unwrap();
    env.reset(.., &mut batch).unwrap();
    let first = batch.obs(0).to_vec();
    let caught = panic::catch_unwind(AssertUnwindSafe(|| {
        env.step(.., &[0.1f32; 3], &mut batch).unwrap();
        panic!("between two calls");
    }));
    assert!(caught.is_err());
    env.seed(.., &[3]).unwrap();
    env.reset(.., &mut batch).unwrap();
    assert_eq!(batch.obs(0), first);
}

#[test]
fn a_panicking_thread_poisons_a_mutex_alone() {
    let shared = Arc::new(Mutex::new(env_of("Reacher-v5", 2, 2)));
    let other = Arc::clone(&shared);
    let joined = thread::spawn(move || {
        let _env = other.lock().unwrap();
        panic!("with the lock");
    })
    .join();
    assert!(joined.is_err());
    let mut env = shared.lock().unwrap_err().into_inner();
    let mut batch = env.batch::<f64>();
    env.reset(.., &mut batch).unwrap();
    env.step(.., &[0.0f32; 4], &mut batch).unwrap();
}

#[test]
fn threads_share_an_environment_through_a_mutex() {
    let shared = Mutex::new(env_of("Reacher-v5", 1, 1));
    let mut batch = shared_batch(&shared);
    shared.lock().unwrap().reset(.., &mut batch).unwrap();
    thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                let mut batch = shared_batch(&shared);
                for _ in 0..10 {
                    shared.lock().unwrap().step(.., &[0.0f32; 2], &mut batch).unwrap();
                }
            });
        }
    });
}

fn shared_batch(shared: &Mutex<Env>) -> mjenv::Batch {
    shared.lock().unwrap().batch::<f64>()
}

#[test]
fn dropped_and_forgotten_under_way() {
    for forgotten in [false, true] {
        let mut env = env_of("HumanoidStandup-v5", 8, 2);
        env.reset(.., &mut env.batch::<f64>()).unwrap();
        env.send(.., &[0.0f32; 8 * 17]).unwrap();
        if forgotten {
            mem::forget(env);
        }
    }
}

#[test]
fn outputs_of_another_environment_are_refused() {
    let mut env = env_of("Reacher-v5", 2, 1);
    for mut other in [env_of("Hopper-v5", 2, 1).batch::<f64>(), env_of("Reacher-v5", 3, 1).batch::<f64>()] {
        assert_eq!(env.reset(.., &mut other).unwrap_err().kind(), ErrorKind::Size);
    }
}

#[test]
fn handles_in_any_order() {
    let options = Options::new("Reacher-v5").unwrap();
    let mut envs: Vec<_> = (0..20).map(|i| Env::new(&options, 1 + i % 3).unwrap()).collect();
    drop(options);
    while !envs.is_empty() {
        let mut env = envs.swap_remove(envs.len() * 7 / 11 % envs.len());
        let mut batch = env.batch::<f64>();
        drop(env.batch::<f64>());
        env.reset(.., &mut batch).unwrap();
        drop(env);
        assert!(batch.obs(0)[0].is_finite());
    }
}
