//! The learner. extras/learn/tests tests what it learns, and that it computes the same bits however it is told to.

use std::fs;

use mjenv::{Env, Error, ErrorKind, Options};
use mjenv_learn::{checkpoint_note, evaluate, Learner, Policy, Precision, Settings, Which};

fn env(settings: &Settings, autoreset_mode: &str) -> Env {
    let mut options = Options::new(settings.id()).unwrap();
    options.set("autoreset_mode", autoreset_mode).unwrap();
    Env::new(&options, settings.get("rows").unwrap()).unwrap()
}

fn learner(settings: &Settings) -> Learner {
    Learner::new(env(settings, "same_step"), settings).unwrap()
}

#[test]
fn a_training_its_checkpoint_and_its_policy() {
    let folder = std::env::temp_dir().join(format!("mjenv-learner-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let (checkpoint, file) = (folder.join("checkpoint"), folder.join("policy.txt"));
    let settings = Settings::new("InvertedPendulum-v5").unwrap();
    let mut first = learner(&settings);
    assert!(first.report().unwrap().mean_return.is_nan());
    first.train(20_000).unwrap();
    first.save_with_note(&checkpoint, "speed=2").unwrap();
    assert_eq!(checkpoint_note(&checkpoint).unwrap(), "speed=2");
    first.train(40_000).unwrap();
    let curve = first.curve().unwrap();
    assert_eq!((curve.len(), curve[0].steps, curve[29].mean_return), (30, 2048, 1000.0));
    assert_eq!(curve[29], first.report().unwrap());

    let mut resumed = learner(settings.clone().set("threads", 2).unwrap());
    resumed.load(&checkpoint).unwrap();
    assert_eq!(resumed.report().unwrap().steps, 20_480);
    let mut resumed = std::thread::spawn(move || resumed.train(40_000).map(|()| resumed)).join().unwrap().unwrap();
    assert_eq!(resumed.policy_text(Which::Last), first.policy_text(Which::Last));
    // New episodes, in another environment.
    let before = resumed.replace_env(env(&settings, "same_step")).unwrap();
    assert_eq!(before.rows(), 8);
    resumed.train(1).unwrap();
    assert_eq!(resumed.report().unwrap().updates, 31);

    first.save_policy(Which::Best, &file).unwrap();
    assert_eq!(fs::read_to_string(&file).unwrap(), first.policy_text(Which::Best).unwrap());
    let policy = Policy::load(&file).unwrap();
    assert_eq!((policy.id(), policy.sizes()), ("InvertedPendulum-v5", (4, 1)));
    let played = evaluate(&mut env(&settings, "disabled"), &first.policy().unwrap(), 10, 100).unwrap();
    assert_eq!((played.returns, played.lengths), (vec![1000.0; 10], vec![1000; 10]));
    let action = policy.act(Precision::Float64, &[0.1, 0.2, 0.3, 0.4, 0.1, 0.2, 0.3, 0.4]).unwrap();
    let rounded = policy.act(Precision::Float32, &[0.1, 0.2, 0.3, 0.4]).unwrap();
    assert!(action.len() == 2 && action[0] == action[1] && (action[0] - rounded[0]).abs() < 1e-5, "{action:?}");
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn settings() {
    let mut settings = Settings::new("Hopper-v5").unwrap();
    assert_eq!((settings.get("rows"), settings.get("hidden")), (Ok(8), Ok("64,64".to_string())));
    for (name, value) in [("rows", 4), ("rollout_steps", 20), ("minibatch_size", 40), ("epochs", 1), ("hidden", 16)] {
        settings.set(name, value).unwrap();
    }
    settings.set("activation", "elu").unwrap().set("actor_obs", "1,1,0,1,1,1,1,1,1,1,1").unwrap();
    settings.set("normalize_reward", false).unwrap().set("gamma", 0.1 + 0.2).unwrap();
    assert_eq!((settings.get("normalize_reward"), settings.get("gamma")), (Ok(false), Ok(0.1 + 0.2)));
    assert_eq!(settings.get::<u8>("gamma").unwrap_err().kind(), ErrorKind::Type);
    assert_eq!(settings.get::<f64>("gama").unwrap_err().kind(), ErrorKind::Name);
    let mut learner = learner(&settings);
    learner.train(80).unwrap();
    assert!(learner.policy_text(Which::Last).unwrap().contains("elu"));
    let policy = learner.policy().unwrap();
    assert_eq!(policy.places(&env(&settings, "same_step")), Ok(vec![0, 1, 3, 4, 5, 6, 7, 8, 9, 10]));
    assert_eq!(policy.act(Precision::Float64, &[0.3; 10]).map(|action| action.len()), Ok(3));
    let ant = Env::new(&Options::new("Ant-v5").unwrap(), 1).unwrap();
    assert_eq!(policy.places(&ant).unwrap_err().kind(), ErrorKind::Size);
    learner.set("learning_rate", 1e-4).unwrap();
    learner.train(1).unwrap();
    let report = learner.report().unwrap();
    assert!(report.learning_rate < 1.001e-4 && report.updates == 2 && report.epochs == 1, "{report:?}");
}

#[test]
fn refusals() {
    fn refused(error: Error, kind: ErrorKind, words: &str) {
        assert!(error.kind() == kind && error.message().contains(words), "{words:?} is not in {error:?}");
    }
    let settings = Settings::new("Hopper-v5").unwrap();
    let wrong = |settings: &Settings, mode| Learner::new(env(settings, mode), settings).unwrap_err();
    refused(wrong(&settings, "disabled"), ErrorKind::Value, "autoreset_mode");
    let set = |name, value| settings.clone().set(name, value).map(|_| ()).unwrap_err();
    refused(set("gamma", "2"), ErrorKind::Value, "settings.gamma is 2");
    refused(set("gamma", "x"), ErrorKind::Type, "settings.gamma is \"x\", not a number");
    refused(set("gamma", "0.5 seed=7"), ErrorKind::Value, "has a blank");
    refused(set("gama", "0.5"), ErrorKind::Name, "nearest: gamma");
    let mut blind = settings.clone();
    blind.set("actor_obs", "1").unwrap();
    refused(wrong(&blind, "same_step"), ErrorKind::Size, "actor_obs has 1 elements");
    let mut learner = learner(&settings);
    refused(learner.load("/nowhere/checkpoint").unwrap_err(), ErrorKind::File, "No such file");
    refused(learner.save("a\0b").unwrap_err(), ErrorKind::Argument, "NUL");
    refused(learner.set("seed", 9).unwrap_err(), ErrorKind::Value, "settings.seed");
    let other = env(Settings::new("Walker2d-v5").unwrap().set("rows", 8).unwrap(), "same_step");
    refused(learner.replace_env(other).unwrap_err(), ErrorKind::Value, "other spaces");
    refused(Policy::parse("no policy").unwrap_err(), ErrorKind::Value, "line 1");
    let policy = learner.policy().unwrap();
    refused(policy.act(Precision::Float64, &[0.0; 12]).unwrap_err(), ErrorKind::Size, "obs_count");
    let mut env = env(&settings, "disabled");
    refused(evaluate(&mut env, &policy, 0, 0).unwrap_err(), ErrorKind::Value, "episodes is 0");
}
