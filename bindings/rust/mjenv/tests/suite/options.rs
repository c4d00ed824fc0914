//! Tests which Rust types options take and give, how they are cloned, and that several threads may use them.

use std::thread;

use mjenv::{Dtype, Env, ErrorKind, Options, Role, Value};

fn ant() -> Options {
    Options::new("Ant-v5").unwrap()
}

#[test]
fn integers_of_every_type() {
    let mut options = ant();
    macro_rules! check {
        ($($type:ty)*) => {$(
            options.set("max_episode_steps", 100 as $type).unwrap();
            assert_eq!(options.get::<$type>("max_episode_steps").unwrap(), 100);
            assert_eq!(options.value("max_episode_steps").unwrap(), Value::Integer(100));
            options.set("max_episode_steps", 1).unwrap();
        )*};
    }
    check!(i8 i16 i32 i64 i128 isize u8 u16 u32 u64 u128 usize);
}

#[test]
fn shapes_of_spaces() {
    let mut options = ant();
    let plain = Env::new(&options, 1).unwrap();
    assert_eq!((plain.observation_space().shape(), plain.action_space().shape()), (&[105][..], &[8][..]));
    options.set("time_aware", true).unwrap();
    options.set("history", 3).unwrap();
    let stacked = Env::new(&options, 1).unwrap();
    assert_eq!((stacked.observation_space().shape(), stacked.observation_space().count()), (&[3, 106][..], 318));
    options.set("history", "qpos=3").unwrap();
    let stacked = Env::new(&options, 1).unwrap();
    assert_eq!(stacked.observation_space().shape(), [106 + 2 * 13]);
}

#[test]
fn numbers_that_do_not_fit() {
    let mut options = ant();
    for error in [
        options.set("max_episode_steps", u64::MAX).unwrap_err(),
        options.set("max_episode_steps", usize::MAX).unwrap_err(),
        options.set("max_episode_steps", u128::from(u64::MAX)).unwrap_err(),
    ] {
        assert_eq!(error.kind(), ErrorKind::Value);
        assert_eq!(error.message(), "option \"max_episode_steps\": 18446744073709551615 does not fit into an i64");
    }
    assert_eq!(options.set("max_episode_steps", i128::MIN).unwrap_err().kind(), ErrorKind::Value);
    assert_eq!(options.get::<i64>("max_episode_steps").unwrap(), 1000);
    let error = options.get::<u8>("max_episode_steps").unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Type);
    assert_eq!(error.message(), "option \"max_episode_steps\" holds Integer(1000), not a u8");
}

#[test]
fn reals_of_both_types() {
    let mut options = ant();
    // 0.1f32 and 0.1 are different numbers.
    options.set("ctrl_cost_weight", 0.1f32).unwrap();
    assert_eq!(options.get::<f64>("ctrl_cost_weight").unwrap(), 0.100_000_001_490_116_12);
    let range = |options: &Options| options.get::<Vec<f64>>("healthy_z_range").unwrap();
    assert_eq!(range(options.set("healthy_z_range", [0.5f32, 2.0]).unwrap()), [0.5, 2.0]);
    assert_eq!(range(options.set("healthy_z_range", [0, 1]).unwrap()), [0.0, 1.0]);
    assert_eq!(range(options.set("healthy_z_range", vec![0.25f32, 3.0]).unwrap()), [0.25, 3.0]);
    assert_eq!(range(options.set("healthy_z_range", &[0.1, 0.7][..]).unwrap()), [0.1, 0.7]);
}

/// If a real number is set to an integer, the type of an info changes. A clone must keep that.
#[test]
fn a_copy_equals_and_goes_its_own_way() {
    let mut options = Options::new("Hopper-v5").unwrap();
    options.set("healthy_reward", 2).unwrap().set("frame_skip", 3).unwrap().set("norm", "plain").unwrap();
    options.set("healthy_z_range", [0.7, f64::INFINITY]).unwrap().set("strict", false).unwrap();
    let mut copy = options.clone();
    assert_eq!(format!("{copy:?}"), format!("{options:?}"));
    let of_env = Env::new(&copy, 1).unwrap().options().clone();
    for options in [&options, &copy, &of_env] {
        let env = Env::new(options, 1).unwrap();
        let survive = env.fields(Role::Info).find(|field| field.name == "reward_survive").unwrap();
        assert_eq!(survive.dtype, Dtype::NativeInt);
    }
    copy.set("frame_skip", 4).unwrap();
    assert_eq!(options.get::<i64>("frame_skip").unwrap(), 3);
    drop(options);
    assert_eq!(copy.get::<i64>("frame_skip").unwrap(), 4);
    assert_eq!(copy.get::<Vec<f64>>("healthy_z_range").unwrap(), [0.7, f64::INFINITY]);
}

#[test]
fn threads_build_environments_of_the_same_options() {
    let mut options = Options::new("Reacher-v5").unwrap();
    options.set("frame_skip", 3).unwrap();
    thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..20 {
                    assert_eq!(options.get::<usize>("frame_skip").unwrap(), 3);
                    assert_eq!(Env::new(&options, 1).unwrap().frame_skip(), 3);
                }
            });
        }
    });
}
