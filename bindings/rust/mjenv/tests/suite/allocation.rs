//! Tests that the crate allocates nothing in steps and resets.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use mjenv::{Env, Options};

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: all work is the system allocator's; the counter needs no memory of its own.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        System.alloc(layout)
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        System.dealloc(pointer, layout)
    }
}

#[global_allocator]
static GLOBAL: Counting = Counting;

fn allocations(work: impl FnOnce()) -> usize {
    let before = ALLOCATIONS.with(Cell::get);
    work();
    ALLOCATIONS.with(Cell::get) - before
}

#[test]
fn a_step_allocates_nothing() {
    let mut env = Env::new(&Options::new("Walker2d-v5").unwrap(), 2).unwrap();
    let (mut batch, mut narrow) = (env.batch::<f64>(), env.batch::<f32>());
    let mut actions = vec![0.0f32; 2 * env.action_space().count()];
    let wide = vec![0.1f64; actions.len()];
    let (mut total, mut received) = (0.0, Vec::with_capacity(2));
    let count = allocations(|| {
        env.seed(.., &[1, 2]).unwrap();
        env.seed_actions(3).unwrap();
        env.reset(.., &mut batch).unwrap();
        for _ in 0..5 {
            env.sample_actions(&mut actions).unwrap();
            env.step(.., &actions, &mut batch).unwrap();
            env.step(.., &wide, &mut narrow).unwrap();
            env.observe(&mut narrow).unwrap();
            total += batch.reward()[0] + batch.info("x_velocity").unwrap()[1] + batch.obs(1)[0];
        }
        env.reset(&[false, true], &mut batch).unwrap();
        env.reset(&[1, 0], &mut batch).unwrap();
        env.step(1, &wide[6..], &mut batch).unwrap();
        env.step(&[1, 0], &actions, &mut narrow).unwrap();
        env.send(&[true, false], &actions).unwrap();
        env.recv(1, None, &mut received, &mut batch).unwrap();
        total += batch.infos().chain(batch.reset_infos()).map(|(_, values)| values[0]).sum::<f64>();
    });
    assert!(total.is_finite());
    assert_eq!(count, 0);
    assert!(allocations(|| drop(vec![total])) > 0, "the counter counts");
}
