//! Tests that handles move between threads. Two threads cannot use one environment at the same time.

use std::thread;

use mjenv::{Batch, Env, Error, ErrorKind, Options, Renderer};

use crate::golden::Golden;
use crate::replay::Replay;

fn is_send<T: Send>() {}
fn is_sync<T: Sync>() {}

#[test]
fn handles_are_send_and_results_are_both() {
    is_send::<Env>();
    is_send::<Options>();
    is_sync::<Options>();
    is_send::<Renderer>();
    is_send::<Batch<f32>>();
    is_sync::<Batch<f32>>();
    is_send::<Error>();
    is_sync::<Error>();
}

/// Compiles only if the type is not Sync. For a Sync type two implementations would match.
macro_rules! assert_not_sync {
    ($type:ty) => {
        const _: fn() = || {
            trait AmbiguousIfSync<Which> {
                fn method() {}
            }
            struct Also;
            impl<T> AmbiguousIfSync<()> for T {}
            impl<T: Sync> AmbiguousIfSync<Also> for T {}
            <$type as AmbiguousIfSync<_>>::method();
        };
    };
}

assert_not_sync!(Env);
assert_not_sync!(Renderer);

#[test]
fn an_episode_goes_on_in_another_thread() {
    let golden = &Golden::of("HalfCheetah-v5");
    let mut replay = Replay::new(golden, 1, 0);
    thread::scope(|scope| {
        for step in 0..20 {
            replay = scope
                .spawn(move || {
                    replay.step(step);
                    let error = replay.env.step(.., &[0.0f32], &mut replay.batch).unwrap_err();
                    assert_eq!(error.kind(), ErrorKind::Size);
                    replay
                })
                .join()
                .unwrap();
        }
    });
}

#[test]
fn environments_run_in_parallel() {
    let goldens = ["Ant-v5", "Humanoid-v5", "Ant-v5"].map(Golden::of);
    thread::scope(|scope| {
        for golden in &goldens {
            scope.spawn(move || {
                let mut replay = Replay::new(golden, 1, 0);
                for step in 0..replay.steps() {
                    replay.step(step);
                }
            });
        }
    });
}

#[test]
fn every_thread_has_its_own_last_error() {
    thread::scope(|scope| {
        for name in 0..4 {
            scope.spawn(move || {
                for _ in 0..200 {
                    let id = format!("Nobody{name}-v4");
                    assert!(Options::new(&id).unwrap_err().message().contains(&id));
                }
            });
        }
    });
}
