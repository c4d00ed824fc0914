//! Tests resets and steps whose outputs the program computes.

use mjenv::{Batch, Computed, Env, ErrorKind, Options};

/// The observations of Hopper-v5, from the exported arrays.
fn hopper(out: &Batch) -> Vec<f64> {
    let (qpos, qvel) = (out.array("qpos").unwrap(), out.array("qvel").unwrap());
    let rows = qpos.chunks(6).zip(qvel.chunks(6));
    rows.flat_map(|(q, v)| q[1..].iter().copied().chain(v.iter().map(|v| v.clamp(-10.0, 10.0)))).collect()
}

#[test]
fn a_program_computes_hopper() {
    let mut options = Options::new("Hopper-v5").unwrap();
    options.set("history", 2).unwrap().set("terminate_when_unhealthy", false).unwrap();
    let mut built_in = Env::new(&options, 3).unwrap();
    let mut options = Options::new("Batch-v0").unwrap();
    options.set("xml_file", "hopper.xml").unwrap().set("frame_skip", 4).unwrap().set("history", 2).unwrap();
    options.set("observations", 11).unwrap().set("arrays", "qpos qvel").unwrap().set("max_episode_steps", 30).unwrap();
    let mut env = Env::new(&options, 3).unwrap();
    let (mut want, mut out) = (built_in.batch::<f64>(), env.batch::<f64>());
    built_in.seed(.., &[1, 2, 3]).unwrap();
    built_in.reset(.., &mut want).unwrap();
    let states = |env: &mut Env, array| (0..3).flat_map(|row| env.read(row, array).unwrap()).collect::<Vec<_>>();
    let (qpos, qvel) = (states(&mut built_in, "qpos"), states(&mut built_in, "qvel"));
    env.begin(.., &qpos, &qvel, &mut out).unwrap();
    let obs = hopper(&out);
    env.finish(.., Some(Computed { obs: &obs, ..Default::default() }), &mut out).unwrap();
    for step in 0..30 {
        let actions: Vec<f64> = (0..9).map(|i| f64::from((7 * i + 3 * step) % 19) / 9.0 - 1.0).collect();
        built_in.step(.., &actions, &mut want).unwrap();
        let mut seen = [0.0; 9];
        env.act(.., &actions, &mut seen).unwrap();
        assert_eq!(seen[..], actions[..]);
        env.advance(.., &seen, &[], &mut out).unwrap();
        assert_eq!(env.advance(.., &seen, &[], &mut out).unwrap_err().kind(), ErrorKind::Pending);
        let obs = hopper(&out);
        let computed = Computed { obs: &obs, reward: &[1.0, 2.0, 3.0], terminated: &[false; 3], ..Default::default() };
        let short = Computed { reward: &[1.0], ..computed };
        assert_eq!(env.finish(.., Some(short), &mut out).unwrap_err().kind(), ErrorKind::Size);
        env.finish(.., Some(computed), &mut out).unwrap();
        for row in 0..3 {
            assert_eq!(out.obs(row), want.obs(row));
        }
        assert_eq!(out.reward(), [1.0, 2.0, 3.0]);
        assert_eq!((out.terminated(), out.truncated()), (&[false; 3][..], &[step == 29; 3][..]));
    }
    assert_eq!(built_in.finish::<f64>(.., None, &mut want).unwrap_err().kind(), ErrorKind::Task);
}
