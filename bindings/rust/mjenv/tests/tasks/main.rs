//! Tests tasks that this program registers. It is a program of its own, because the ids stay registered.

#[allow(dead_code)] // the test `plugin` uses all of it
mod equal;
#[path = "../plugin/hopper/src/hopper.rs"]
mod hopper;

use std::sync::atomic::{AtomicI32, AtomicUsize, Ordering};

use mjenv::task::*;
use mjenv::{load_tasks, register, Env, Error, ErrorKind, Options, Role};

use hopper::Hopper;

const MODEL: &str = r#"<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="ball" pos="0 0 0.1">
      <freejoint name="free"/>
      <geom name="ball" size="0.1"/>
      <site name="top" pos="0 0 0.1"/>
    </body>
    <body name="arm" pos="1 0 1">
      <joint name="hinge" axis="0 1 0"/>
      <geom size="0.05" mass="0.5"/>
    </body>
  </worldbody>
  <actuator><motor name="push" joint="hinge" ctrllimited="true" ctrlrange="-1 1"/></actuator>
  <sensor><jointvel name="before" joint="hinge"/><framepos name="place" objtype="site" objname="top"/></sensor>
</mujoco>"#;

fn env_with(id: &str, set: impl FnOnce(&mut Options)) -> Result<Env, Error> {
    let mut options = Options::new(id)?;
    options.set("num_threads", 2)?;
    set(&mut options);
    Env::new(&options, 4)
}

fn env(id: &str) -> Result<Env, Error> {
    env_with(id, |_| ())
}

/// Does what the option `how` says in the method that the option `place` names.
struct Misbehaves {
    place: String,
    how: String,
}

impl Misbehaves {
    fn act(&self, place: &str, row: f64) -> Result {
        // One row of four, and not in the trial calls.
        if self.place != place || row != 1.0 {
            return Ok(());
        }
        match self.how.as_str() {
            "text" => panic!("the arm\0broke"),
            "string" => panic!("the arm broke {} times", 3),
            "number" => std::panic::panic_any(7),
            "payload" => std::panic::panic_any(PanicsInDrop),
            "error" => Err("the arm is missing".into()),
            "parse" => Err("x".parse::<f64>().map(drop).unwrap_err().into()),
            _ => Ok(()),
        }
    }
}

struct PanicsInDrop;

impl Drop for PanicsInDrop {
    fn drop(&mut self) {
        panic!("again");
    }
}

impl Task for Misbehaves {
    const ID: &'static str = "Misbehaves-v0";
    const MODEL: Model = Model::Text(MODEL);

    fn build(b: &mut Builder) -> Result<Self> {
        let place = b.text("place", "nowhere", &[], "where it misbehaves");
        let how =
            b.text("how", "text", &["text", "string", "number", "payload", "error", "parse"], "how it misbehaves");
        let _: Carry<1> = b.carry(); // the library calls carry only if there is a number to write
        let this = Self { place, how };
        if b.sim().is_some() {
            this.act("build", 1.0)?;
        }
        Ok(this)
    }

    fn reset(&self, start: &mut Start, rng: &mut Rng) -> Result {
        let row = rng.integers(0, 2);
        start.qpos[0] = row as f64;
        self.act("reset", row as f64)
    }

    fn carry(&self, sim: &Sim, _: &mut Carried) -> Result {
        self.act("carry", sim.qpos()[0])
    }

    fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
        observation.put_all("qpos", sim.qpos());
        self.act("observe", sim.qpos()[0])
    }

    fn step(&self, sim: &Sim, _: &mut Row, _: &mut Fields) -> Result<Outcome> {
        self.act("step", sim.qpos()[0].round())?;
        Ok(Outcome { reward: 1.0, terminated: false })
    }
}

impl Drop for Misbehaves {
    fn drop(&mut self) {
        if self.place == "drop" {
            panic!("in drop");
        }
    }
}

#[test]
fn a_panic_or_an_err_is_the_error_of_its_row() {
    register::<Misbehaves>().unwrap();
    let expected = [
        ("text", "it panicked: the arm\\0broke"),
        ("string", "it panicked: the arm broke 3 times"),
        ("number", "it panicked: it is no text"),
        ("payload", "it panicked: it is no text"),
        ("error", "the arm is missing"),
        ("parse", "invalid float literal"),
    ];
    for (how, text) in expected {
        for place in ["build", "reset", "carry", "observe", "step", "drop"] {
            let made = env_with("Misbehaves-v0", |options| {
                options.set("place", place).unwrap().set("how", how).unwrap();
            });
            let mut env = match made {
                Ok(env) => env,
                Err(error) => {
                    assert_eq!((place, error.kind()), ("build", ErrorKind::Task));
                    assert_eq!(error.message(), format!("Misbehaves-v0: build: {text}"));
                    continue;
                }
            };
            assert_ne!(place, "build");
            let mut batch = env.batch::<f64>();
            env.seed(.., &[1, 2, 3, 4]).unwrap();
            let result = env.reset(.., &mut batch).and_then(|()| env.step(.., &[0.0f64; 4], &mut batch));
            if place == "drop" {
                result.unwrap();
                continue;
            }
            let error = result.unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Task);
            assert!(error.message().contains(&format!("Misbehaves-v0: {place}: {text}")), "{error}");
            if place == "step" {
                let failed: Vec<_> = (0..4).map(|row| batch.failed(row)).collect();
                let expected: Vec<_> = (0..4).map(|row| env.read(row, "qpos").unwrap()[0].round() == 1.0).collect();
                assert_eq!(failed, expected);
                assert!(failed.contains(&false));
                assert!(batch.reward().iter().zip(&failed).all(|(&reward, &failed)| failed || reward == 1.0));
            }
        }
    }
}

/// A task whose description is wrong in one way, or whose build runs `BUILD`.
macro_rules! wrong {
    ($($name:ident: $id:expr, $model:expr, $skip:expr, $build:expr;)*) => {$(
        struct $name;

        impl Task for $name {
            const ID: &'static str = $id;
            const MODEL: Model = $model;
            const FRAME_SKIP: u32 = $skip;

            fn build(b: &mut Builder) -> Result<Self> {
                let build: fn(&mut Builder) = $build;
                build(b);
                Ok(Self)
            }

            fn reset(&self, _: &mut Start, _: &mut Rng) -> Result {
                Ok(())
            }

            fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
                observation.put_all("qpos", sim.qpos());
                Ok(())
            }

            fn step(&self, _: &Sim, _: &mut Row, _: &mut Fields) -> Result<Outcome> {
                Ok(Outcome { reward: 0.0, terminated: false })
            }
        }
    )*};
}

wrong! {
    BuiltIn: "Hopper-v5", Model::Text(MODEL), 1, |_| ();
    NoVersion: "Hopper", Model::Text(MODEL), 1, |_| ();
    Nul: "Nul\0-v0", Model::Text(MODEL), 1, |_| ();
    NoModel: "NoModel-v0", Model::Text(""), 1, |_| ();
    NoSkip: "NoSkip-v0", Model::Text(MODEL), 0, |_| ();
    LongSkip: "LongSkip-v0", Model::Text(MODEL), u32::MAX, |_| ();
    Taken: "Taken-v0", Model::Text(MODEL), 1, |b| { let _ = b.real("frame_skip", 0.0, ""); };
    Bounds: "Bounds-v0", Model::Text(MODEL), 1, |b| { let _ = b.real_within("weight", 2.0, 0.0..=1.0, ""); };
    Panics: "Panics-v0", Model::Text(MODEL), 1, |_| panic!("no");
    Twice: "Twice-v0", Model::Text(MODEL), 1, |_| ();
    NoSite: "NoSite-v0", Model::Text(MODEL), 1, |b| { let _ = b.site("tip"); };
    NoArray: "NoArray-v0", Model::Text(MODEL), 1, |b| { let _ = b.array::<f64>("qpoz"); };
    OtherArray: "OtherArray-v0", Model::Text(MODEL), 1, |b| { let _ = b.array::<i32>("qpos"); };
    NoNeed: "NoNeed-v0", Model::Text(MODEL), 1, |b| b.need("xpos");
    Missing: "Missing-v0", Model::File("/no such model.xml"), 1, |_| ();
}

#[test]
fn wrong_descriptions_are_refused() {
    let refused = |result: Result<(), Error>, kind: ErrorKind, text: &str| {
        let error = result.unwrap_err();
        assert!(error.kind() == kind && error.message().contains(text), "{error:?}");
    };
    refused(register::<BuiltIn>(), ErrorKind::Value, "\"Hopper-v5\"");
    refused(register::<NoVersion>(), ErrorKind::Value, "\"Hopper\"");
    refused(register::<Nul>(), ErrorKind::Task, "NUL character");
    refused(register::<NoModel>(), ErrorKind::Value, "model_text is empty");
    refused(register::<NoSkip>(), ErrorKind::Value, "frame_skip is 0");
    refused(register::<LongSkip>(), ErrorKind::Value, "frame_skip is 2147483647");
    refused(register::<Taken>(), ErrorKind::Value, "already an option \"frame_skip\"");
    refused(register::<Bounds>(), ErrorKind::Value, "does not lie in [0, 1]");
    refused(register::<Panics>(), ErrorKind::Task, "Panics-v0: build: it panicked: no");
    register::<Twice>().unwrap();
    refused(register::<Twice>(), ErrorKind::Value, "\"Twice-v0\"");
}

#[test]
fn a_model_that_lacks_what_the_task_asks_for_is_refused() {
    fn refused<T: Task>(kind: ErrorKind, text: &str) {
        register::<T>().unwrap();
        let error = env(T::ID).unwrap_err();
        assert!(error.kind() == kind && error.message().contains(text), "{error:?}");
    }
    refused::<NoSite>(ErrorKind::Model, "\"tip\"");
    refused::<NoArray>(ErrorKind::Name, "\"qpoz\"");
    refused::<OtherArray>(ErrorKind::Task, "it panicked: the elements of \"qpos\" are no i32");
    refused::<NoNeed>(ErrorKind::Name, "not computed on demand");
    refused::<Missing>(ErrorKind::File, "no such model.xml");
}

/// Writes other fields than in its trial calls if the option `wrong` says so.
struct Fickle(String);

impl Task for Fickle {
    const ID: &'static str = "Fickle-v0";
    const MODEL: Model = Model::Text(MODEL);

    fn build(b: &mut Builder) -> Result<Self> {
        Ok(Self(b.text("wrong", "", &[], "")))
    }

    fn reset(&self, start: &mut Start, _: &mut Rng) -> Result {
        start.qpos[0] = 1.0;
        Ok(())
    }

    fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
        observation.put_all("qpos", sim.qpos());
        if self.0 == "twice" {
            observation.put_all("qpos", sim.qpos());
        }
        Ok(())
    }

    fn step(&self, sim: &Sim, _: &mut Row, info: &mut Fields) -> Result<Outcome> {
        let wrong = if sim.qpos()[0] == 0.0 { "" } else { self.0.as_str() };
        info.put("a", 1.0);
        match wrong {
            "shorter" => info.put_all("b", [1.0]),
            "longer" => info.put_all("b", [1.0; 3]),
            "other" => info.put_all("c", [1.0; 2]),
            "scalar" => info.put("b", 1.0),
            _ => info.put_all("b", [1.0; 2]),
        };
        if wrong == "more" {
            info.put("c", 1.0);
        }
        if wrong != "fewer" {
            info.put("last", true);
        }
        Ok(Outcome { reward: if wrong == "nan" { f64::NAN } else { 0.0 }, terminated: false })
    }
}

#[test]
fn fields_must_be_the_same_in_each_call() {
    register::<Fickle>().unwrap();
    let step = |wrong: &str| {
        let mut env = env_with(Fickle::ID, |options| {
            options.set("wrong", wrong).unwrap();
        })?;
        let mut batch = env.batch::<f64>();
        env.reset(.., &mut batch)?;
        env.step(.., &[0.0f64; 4], &mut batch)
    };
    step("").unwrap();
    let expected = [
        ("twice", "trial call of observe: the field \"qpos\" is written twice"),
        ("shorter", "the field \"b\" has 1 number(s), but it had 2"),
        ("longer", "the field \"b\" has 3 number(s), but it had 2"),
        ("other", "the field \"c\" is written where the trial call wrote \"b\""),
        ("scalar", "the field \"b\" is one number, but it was a vector"),
        ("more", "the field \"c\" is written where the trial call wrote \"last\""),
        ("fewer", "the field \"last\" is not written"),
        ("nan", "the reward is NaN"),
    ];
    for (wrong, text) in expected {
        let error = step(wrong).unwrap_err();
        assert!(error.kind() == ErrorKind::Task && error.message().contains(text), "{wrong}: {error}");
    }
}

/// The greatest target in environments that are built now.
static GREATEST: AtomicI32 = AtomicI32::new(4);

/// Carries an index.
struct Reach {
    target: Carry<1>,
}

impl Task for Reach {
    const ID: &'static str = "Bounded-v0";
    const MODEL: Model = Model::Text(MODEL);

    fn build(b: &mut Builder) -> Result<Self> {
        let greatest = f64::from(GREATEST.load(Ordering::SeqCst));
        Ok(Self { target: b.carry_within(0.0..=greatest) })
    }

    fn reset(&self, start: &mut Start, _: &mut Rng) -> Result {
        start.carried.set(self.target, [3.0]);
        Ok(())
    }

    fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
        let place = [0.5, 1.5, 2.5, 3.5, 4.5];
        observation.put("place", place[sim.carried(self.target)[0] as usize]);
        Ok(())
    }

    fn step(&self, _: &Sim, _: &mut Row, _: &mut Fields) -> Result<Outcome> {
        Ok(Outcome { reward: 0.0, terminated: false })
    }
}

#[test]
fn an_image_with_a_number_out_of_bounds_is_refused() {
    register::<Reach>().unwrap();
    let mut wide = env(Reach::ID).unwrap();
    let mut batch = wide.batch::<f64>();
    wide.reset(.., &mut batch).unwrap();
    assert_eq!(batch.obs(0), [3.5]);
    let image = wide.snapshot(0).unwrap();
    wide.restore(1, &image).unwrap();

    GREATEST.store(2, Ordering::SeqCst);
    let mut narrow = env(Reach::ID).unwrap();
    assert_eq!(narrow.restore(0, &image).unwrap_err().kind(), ErrorKind::Snapshot);
    let error = narrow.reset(.., &mut batch).unwrap_err();
    assert!(
        error.kind() == ErrorKind::Task && error.message().contains("reset: carried[0] is 3, not 0 to 2"),
        "{error}"
    );
    GREATEST.store(-1, Ordering::SeqCst);
    assert_eq!(env(Reach::ID).unwrap_err().kind(), ErrorKind::Value);
}

/// Shows its live parameters, and the number of steps, which resets keep.
struct Commanded {
    speed: Live<1>,
    gains: Live<2>,
    steps: Carry<1>,
    level: Carry<1>,
}

impl Task for Commanded {
    const ID: &'static str = "Commanded-v0";
    const MODEL: Model = Model::Text(MODEL);

    fn build(b: &mut Builder) -> Result<Self> {
        Ok(Self {
            speed: b.live_within("speed", [0.5], -2.0..=2.0, "the commanded speed, m/s"),
            gains: b.live("gains", [1.0, 2.0], "of the reward"),
            steps: b.carry(),
            level: b.keep_within(0.0..=9.0),
        })
    }

    fn reset(&self, start: &mut Start, _: &mut Rng) -> Result {
        start.qvel[0] = start.live(self.speed)[0];
        Ok(())
    }

    fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
        observation.put("speed", sim.live(self.speed)[0]);
        observation.put_all("gains", sim.live(self.gains));
        observation.put("steps", sim.carried(self.steps)[0]);
        observation.put("level", sim.carried(self.level)[0]);
        Ok(())
    }

    fn step(&self, sim: &Sim, row: &mut Row, _: &mut Fields) -> Result<Outcome> {
        for numbers in [self.steps, self.level] {
            let [count] = row.carried.get(numbers);
            row.carried.set(numbers, [count + 1.0]);
        }
        Ok(Outcome { reward: sim.live(self.gains)[1], terminated: false })
    }
}

#[test]
fn live_parameters_and_kept_numbers() {
    register::<Commanded>().unwrap();
    let mut env = env(Commanded::ID).unwrap();
    let rows = env.rows();
    let mut batch = env.batch::<f64>();
    assert_eq!(env.read(0, "parameters.gains").unwrap(), [1.0, 2.0]);
    env.write(&[1], "parameters.speed", &[-1.5]).unwrap();
    env.write(.., "parameters.gains", &[3.0, 4.0]).unwrap();
    env.reset(.., &mut batch).unwrap();
    assert_eq!(env.read(1, "qvel").unwrap()[0], -1.5);
    for steps in 1..=3 {
        env.step(.., &vec![0.0; rows], &mut batch).unwrap();
        assert_eq!(batch.obs(0), [0.5, 3.0, 4.0, f64::from(steps), f64::from(steps)]);
        assert_eq!(batch.obs(1)[0], -1.5);
        assert_eq!(batch.reward()[1], 4.0);
    }
    env.reset(.., &mut batch).unwrap();
    assert_eq!(batch.obs(1), [-1.5, 3.0, 4.0, 0.0, 3.0]);
    let error = env.write(&[1], "parameters.speed", &[2.5]).unwrap_err();
    assert!(error.kind() == ErrorKind::Value && error.message().contains("row 1: parameters.speed"), "{error}");
    assert_eq!(env.write(.., "parameters.sped", &[0.0]).unwrap_err().kind(), ErrorKind::Name);
}

/// Has groups of terms, and a term without one.
struct Grouped;

impl Task for Grouped {
    const ID: &'static str = "Grouped-v0";
    const MODEL: Model = Model::Text(MODEL);

    fn build(_: &mut Builder) -> Result<Self> {
        Ok(Self)
    }

    fn reset(&self, start: &mut Start, rng: &mut Rng) -> Result {
        start.qvel[0] = rng.normal();
        Ok(())
    }

    fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
        observation.put("height", sim.qpos()[2]).group("policy");
        observation.put_all("speeds", &sim.qvel()[..3]).group("policy").doc("m/s");
        observation.put("mass", sim.body_mass()[1]).group("critic");
        observation.put("time", sim.time());
        Ok(())
    }

    fn step(&self, _: &Sim, _: &mut Row, _: &mut Fields) -> Result<Outcome> {
        Ok(Outcome { reward: 0.0, terminated: false })
    }
}

#[test]
fn an_observation_has_groups() {
    register::<Grouped>().unwrap();
    let mut grouped = env(Grouped::ID).unwrap();
    let keys: Vec<_> = grouped.fields(Role::Groups).map(|key| (key.name.into_owned(), key.offset, key.count)).collect();
    assert_eq!(keys, [("policy".to_string(), 0, 4), ("critic".to_string(), 4, 1), ("time".to_string(), 5, 1)]);
    let mut batch = grouped.batch::<f32>();
    grouped.reset(.., &mut batch).unwrap();
    for row in 0..grouped.rows() {
        assert_eq!(batch.group(row, "policy").unwrap(), &batch.obs(row)[..4]);
        assert_eq!(batch.group(row, "policy").unwrap()[1], grouped.read(row, "qvel").unwrap()[0] as f32);
        assert_eq!(batch.group(row, "critic").unwrap(), [grouped.read(row, "body_mass").unwrap()[1] as f32]);
        assert_eq!(batch.group(row, "time").unwrap(), [0.0]);
    }
    let error = batch.group(0, "actor").unwrap_err();
    assert!(error.message().contains("\"actor\"; there are policy, critic, time"), "{error}");

    let flat = env_with(Grouped::ID, |options| {
        options.set("observation", "flat").unwrap();
    });
    let flat = flat.unwrap();
    assert_eq!(flat.fields(Role::Groups).count(), 0);
    assert_eq!(flat.batch::<f64>().group(0, "policy").unwrap_err().kind(), ErrorKind::Name);
}

static DROPPED: AtomicUsize = AtomicUsize::new(0);

/// Uses everything that a task can read.
struct Ball {
    weight: f64,
    gains: [f64; 3],
    limit: i64,
    mode: String,
    body: usize,
    hinge: Joint,
    place: Sensor,
    mass: Array<f64>,
    parents: Array<i32>,
    steps: Carry<1>,
    goal: Carry<3>,
}

impl Drop for Ball {
    fn drop(&mut self) {
        DROPPED.fetch_add(1, Ordering::SeqCst);
    }
}

impl Task for Ball {
    const ID: &'static str = "Ball-v3";
    const MODEL: Model = Model::Text(MODEL);
    const FRAME_SKIP: u32 = 2;
    const TIME_LIMIT: u64 = 7;

    fn build(b: &mut Builder) -> Result<Self> {
        b.need("contacts");
        b.need("geom_xpos");
        b.need("cfrc_ext");
        b.reward_dtype(Dtype::NativeFloat);
        Ok(Self {
            weight: b.real_within("weight", 0.5, 0.0..=1.0, "a weight"),
            gains: b.reals("gains", [1.0, 2.0, 3.0], "gains"),
            limit: b.integer("limit", 3, 1..=9, "a limit"),
            mode: b.text("mode", "slow", &["slow", "fast"], "a mode"),
            body: b.object_option("body", "body", 1, "a body"),
            hinge: b.joint("hinge"),
            place: b.sensor("place"),
            mass: b.array("body_mass"),
            parents: b.array("body_parentid"),
            steps: b.carry(),
            goal: b.carry(),
        })
    }

    fn reset(&self, start: &mut Start, rng: &mut Rng) -> Result {
        assert_eq!((start.qpos.len(), start.qvel.len(), start.act.len()), (8, 7, 0));
        assert_eq!(start.qpos, start.qpos0);
        let order = rng.permutation(3);
        start.carried.set(self.goal, [order[0] as f64, order[1] as f64, order[2] as f64]);
        start.qpos[self.hinge.qpos] = 0.25;
        start.qvel[self.hinge.qvel] = 0.5;
        Ok(())
    }

    fn reset_info(&self, sim: &Sim, info: &mut Fields) -> Result {
        info.put_all("goal", sim.carried(self.goal));
        Ok(())
    }

    fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
        observation.put_all("goal", sim.carried(self.goal));
        observation.put("steps", sim.carried(self.steps)[0]).doc("since the reset");
        observation.put_all("nothing", [0.0; 0]);
        Ok(())
    }

    fn step(&self, sim: &Sim, row: &mut Row, info: &mut Fields) -> Result<Outcome> {
        let [steps] = row.carried.get(self.steps);
        row.carried.set(self.steps, [steps + 1.0]);
        assert_eq!(sim.array(self.mass), sim.body_mass());
        assert_eq!(sim.array(self.parents), [0, 0, 0]);
        assert_eq!(sim.xpos()[1], sim.geom_xpos()[1]);
        assert_eq!(sim.cfrc_ext().len(), 3);
        assert_eq!(sim.sensor(self.place), sim.site_xpos()[0]);
        assert_eq!((sim.timestep(), sim.dt(), sim.ctrl()[0]), (0.002, 0.004, sim.action().values[0]));
        info.put("contacts", sim.contacts().len() as u32);
        info.put("time", sim.time());
        info.put("draw", row.rng.random());
        info.put("mass", sim.array(self.mass)[self.body]);
        info.put("options", self.weight + self.gains[2] + self.limit as f64).doc("some of them");
        info.put("fast", self.mode == "fast");
        info.put_all("forces", sim.contacts().iter().map(|contact| contact.force[0]).take(1));
        Ok(Outcome { reward: 0.0, terminated: false })
    }
}

#[test]
fn a_task_reads_its_row_and_carries_numbers() {
    register::<Ball>().unwrap();
    let dropped = DROPPED.load(Ordering::SeqCst);
    let mut env = env_with(Ball::ID, |options| {
        options.set("weight", 0.25).unwrap().set("gains", [1.0, 2.0, 8.0]).unwrap().set("limit", 5).unwrap();
        options.set("mode", "fast").unwrap().set("body", "arm").unwrap();
        assert_eq!(options.set("weight", 2.0).unwrap_err().kind(), ErrorKind::Value);
        assert_eq!(options.set("mode", "quick").unwrap_err().kind(), ErrorKind::Value);
    })
    .unwrap();
    let (mut batch, mut next) = (env.batch::<f64>(), env.batch::<f64>());
    let names = |role| env.fields(role).map(|field| (field.name.to_string(), field.count)).collect::<Vec<_>>();
    assert_eq!(names(Role::Observation), [("goal".to_string(), 3), ("steps".to_string(), 1)]);
    assert_eq!(env.fields(Role::Reward).next().unwrap().dtype, Dtype::NativeFloat);
    let infos: Vec<_> = env.fields(Role::Info).map(|field| (field.name.into_owned(), field.doc)).collect();
    assert_eq!(infos[4], ("options".to_string(), "some of them"));
    assert_eq!((env.spec().version, env.spec().robot, env.spec().max_episode_steps), (3, "Ball", 7));

    // numpy.random.default_rng(s).permutation(3) for s = 1, 2, 3, 4
    env.seed(.., &[1, 2, 3, 4]).unwrap();
    env.reset(.., &mut batch).unwrap();
    let goals = [[0.0, 1.0, 2.0], [2.0, 0.0, 1.0], [2.0, 1.0, 0.0], [0.0, 1.0, 2.0]];
    assert_eq!(batch.reset_info("goal").unwrap(), goals.concat());
    for step in 1..=3 {
        env.step(.., &[0.5f64; 4], &mut batch).unwrap();
        assert_eq!(batch.obs(2)[3], f64::from(step));
    }
    assert_eq!(batch.info("mass").unwrap(), [0.5; 4]);
    assert_eq!(batch.info("options").unwrap(), [0.25 + 8.0 + 5.0; 4]);
    assert_eq!(batch.info("fast").unwrap(), [1.0; 4]);
    assert!(batch.info("contacts").unwrap().iter().all(|&count| count == 1.0));

    let image = env.snapshot(..).unwrap();
    env.step(.., &[0.5f64; 4], &mut batch).unwrap();
    env.restore(.., &image).unwrap();
    env.step(.., &[0.5f64; 4], &mut next).unwrap();
    assert_eq!(next.observations(), batch.observations());
    assert_eq!(next.info("draw"), batch.info("draw"));
    assert_eq!(next.obs(0)[3], 4.0);

    assert_eq!(DROPPED.load(Ordering::SeqCst), dropped);
    drop(env);
    assert_eq!(DROPPED.load(Ordering::SeqCst), dropped + 1);
}

/// Shows where the falling ball is, according to qpos and to mjData's positions of bodies.
struct Falls {
    ball: usize,
}

impl Task for Falls {
    const ID: &'static str = "Falls-v0";
    const MODEL: Model = Model::Text(MODEL);

    fn build(b: &mut Builder) -> Result<Self> {
        if b.flag("current", true, "see the new state") {
            b.current();
        }
        Ok(Self { ball: b.body("ball") })
    }

    fn reset(&self, start: &mut Start, rng: &mut Rng) -> Result {
        start.qpos[2] = rng.uniform(2.0, 3.0);
        Ok(())
    }

    fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
        observation.put_all("height", [sim.qpos()[2], sim.xpos()[self.ball][2]]);
        Ok(())
    }

    fn step(&self, _: &Sim, _: &mut Row, _: &mut Fields) -> Result<Outcome> {
        Ok(Outcome { reward: 0.0, terminated: false })
    }
}

#[test]
fn a_task_sees_the_new_state() {
    register::<Falls>().unwrap();
    for current in [false, true] {
        let mut env = env_with(Falls::ID, |options| {
            options.set("current", current).unwrap();
        })
        .unwrap();
        let mut batch = env.batch::<f64>();
        env.reset(.., &mut batch).unwrap();
        for _ in 0..5 {
            env.step(.., &[0.0f64; 4], &mut batch).unwrap();
            assert!((0..4).all(|row| (batch.obs(row)[0] == batch.obs(row)[1]) == current));
        }
    }
}

/// Its reset lets the ball fall until it touches the floor, begins again 5 cm above, and moves a marker.
struct Falling {
    place: Own,
    places: Array<f64>,
    touched: Carry<1>,
    impatient: bool,
}

impl Task for Falling {
    const ID: &'static str = "Falling-v0";
    const MODEL: Model = Model::Text(
        r#"<mujoco><option timestep='0.01'/><worldbody><geom name='floor' type='plane' size='5 5 .1'/>
           <geom name='marker' pos='0 0 2' size='.1' contype='0' conaffinity='0'/>
           <body name='ball' pos='0 0 1'><joint name='z' type='slide' axis='0 0 1'/><geom size='.1'/></body>
           </worldbody></mujoco>"#,
    );

    fn build(b: &mut Builder) -> Result<Self> {
        b.current();
        b.random_state();
        Ok(Self {
            place: b.own("geom_pos"),
            places: b.array("geom_pos"),
            touched: b.carry(),
            impatient: b.flag("impatient", false, "wait for a timestep alone"),
        })
    }

    fn reset(&self, start: &mut Start, rng: &mut Rng) -> Result {
        let marker = &mut start.own(self.place)[3..6];
        marker[0] = rng.state_uniform(0.0, 1.0);
        marker[1] += 1.0; // counts the resets
        start.forward()?;
        for _ in 0..if self.impatient { 1 } else { 100 } {
            if start.contact_count() > 0 {
                break;
            }
            start.advance(1)?;
        }
        if start.contact_count() == 0 {
            return Err("the ball never touches the floor".into());
        }
        let touched = start.see(|sim| sim.xpos()[1][2]);
        assert_eq!(touched, 1.0 + start.qpos[0]);
        start.restart()?;
        assert_eq!(start.qpos[0], 0.0);
        start.qpos[0] = touched - 1.0 + 0.05;
        start.set_time(0.5);
        start.carried.set(self.touched, [touched]);
        Ok(())
    }

    fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
        observation.put_all("marker", sim.array(self.places)[3..6].iter().copied());
        observation.put_all("ball", [sim.qpos()[0], sim.xpos()[1][2], sim.time()]);
        observation.put_all("touched", sim.carried(self.touched));
        Ok(())
    }

    fn step(&self, _: &Sim, _: &mut Row, _: &mut Fields) -> Result<Outcome> {
        Ok(Outcome { reward: 0.0, terminated: false })
    }
}

#[test]
fn a_reset_simulates() {
    register::<Falling>().unwrap();
    let mut env = env(Falling::ID).unwrap();
    let mut batch = env.batch::<f64>();
    env.seed(.., &[1, 2, 3, 1]).unwrap();
    env.reset(.., &mut batch).unwrap();
    // numpy.random.RandomState(seed).uniform(0, 1)
    let drawn = [0.417022004702574, 0.43599490214200376, 0.5507979025745755, 0.417022004702574];
    for (row, drawn) in drawn.into_iter().enumerate() {
        let obs = batch.obs(row);
        assert_eq!(&obs[..3], [drawn, 1.0, 2.0]);
        assert!((0.05..0.1).contains(&obs[6]), "where it touches: {}", obs[6]);
        assert_eq!(&obs[3..6], [obs[6] - 1.0 + 0.05, 1.0 + (obs[6] - 1.0 + 0.05), 0.5]);
    }
    env.reset(.., &mut batch).unwrap();
    assert!((0..4).all(|row| batch.obs(row)[1] == 2.0));

    let mut impatient = env_with(Falling::ID, |options| {
        options.set("impatient", true).unwrap();
    })
    .unwrap();
    let error = impatient.reset(.., &mut batch).unwrap_err();
    assert!(error.message().contains("Falling-v0: reset: the ball never touches the floor"), "{error}");
}

/// tests/tasks/follow.cpp written again.
struct Follow {
    kp: f64,
    kd: f64,
    limit: f64,
    trunk: usize,
    marker: usize,
    joints: [Joint; 2],
    home: Array<f64>,
    forces: Array<f64>,
    places: Array<f64>,
    target: Carry<2>,
    torque: Carry<2>,
    gust: Own,
    place: Option<Own>,
}

impl Task for Follow {
    const ID: &'static str = "tests/RustFollow-v0";
    const MODEL: Model = Model::Text(include_str!("../../../../../tests/tasks/follow.xml"));
    const FRAME_SKIP: u32 = 4;
    const TIME_LIMIT: u64 = 50;

    fn build(b: &mut Builder) -> Result<Self> {
        b.action(&[-1.0..=1.0, -1.0..=1.0]);
        let place = b.flag("current", false, "see the new state, and move the marker").then(|| {
            b.current();
            b.need("geom_xpos");
            b.own("geom_pos")
        });
        Ok(Self {
            kp: b.real("kp", 30.0, "N m/rad"),
            kd: b.real("kd", 1.0, "N m s/rad"),
            limit: b.real("limit", 40.0, "the greatest height of the trunk, m"),
            trunk: b.body("trunk"),
            marker: b.geom("marker"),
            joints: [b.joint("hip"), b.joint("knee")],
            home: b.array("key_qpos"),
            forces: b.array("xfrc_applied"),
            places: b.array("geom_pos"),
            target: b.carry(),
            torque: b.carry(),
            gust: b.own("xfrc_applied"),
            place,
        })
    }

    fn reset(&self, start: &mut Start, rng: &mut Rng) -> Result {
        const HOME: [f64; 9] = [0.0, 0.0, 0.7, 1.0, 0.0, 0.0, 0.0, 0.5, -0.9];
        for (qpos, home) in start.qpos.iter_mut().zip(HOME) {
            *qpos = home + rng.uniform(-0.05, 0.05);
        }
        Ok(())
    }

    fn before_step(&self, sim: &Sim, row: &mut Row, control: &mut Control) -> Result {
        let mut target = row.carried.get(self.target);
        for (i, target) in target.iter_mut().enumerate() {
            let wanted = sim.array(self.home)[self.joints[i].qpos] + 0.5 * sim.action().values[i].clamp(-0.8, 0.8);
            *target += 0.4 * (wanted - *target);
        }
        row.carried.set(self.target, target);
        control.own(self.gust)[6 * self.trunk] = row.rng.uniform(-20.0, 20.0);
        Ok(())
    }

    fn before_substep(&self, sim: &Sim, row: &mut Row, control: &mut Control) -> Result {
        if control.substep() == 3 && sim.qpos()[2] > self.limit {
            return Err("the trunk flies".into());
        }
        control.own(self.gust)[6 * self.trunk + 2] = control.substep() as f64;
        let (target, mut torque) = (row.carried.get(self.target), row.carried.get(self.torque));
        for (i, torque) in torque.iter_mut().enumerate() {
            let joint = self.joints[i];
            control.set(i, *torque);
            *torque = self.kp * (target[i] - sim.qpos()[joint.qpos]) - self.kd * sim.qvel()[joint.qvel];
        }
        row.carried.set(self.torque, torque);
        Ok(())
    }

    fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
        observation.put_all("qpos", sim.qpos());
        observation.put_all("qvel", sim.qvel());
        observation.put_all("ctrl", sim.ctrl());
        observation.put_all("target", sim.carried(self.target));
        observation.put_all("sites", sim.xpos()[self.trunk]);
        observation.put_all("gust", &sim.array(self.forces)[6 * self.trunk..][..6]);
        if self.place.is_some() {
            let place = &sim.array(self.places)[3 * self.marker..][..3];
            observation.put_all("marker", place.iter().copied().chain(sim.geom_xpos()[self.marker]));
        }
        Ok(())
    }

    fn step(&self, sim: &Sim, row: &mut Row, info: &mut Fields) -> Result<Outcome> {
        info.put("speed", sim.qvel()[0]);
        if let Some(place) = self.place {
            row.own(place)[3 * self.marker] += 0.25;
        }
        row.qvel()[1] += 0.1 * sim.action().values[0];
        Ok(Outcome { reward: sim.action().values.iter().sum(), terminated: false })
    }
}

#[test]
fn maps_of_actions_and_own_arrays_equal_those_in_cpp() {
    register::<Follow>().unwrap();
    let folder = std::env::var("MJENV_LIB_DIR").unwrap();
    load_tasks(format!("{folder}/tests/tasks/libfollow.so")).unwrap();
    for current in [false, true] {
        let mut envs = [Follow::ID, "tests/Follow-v0"].map(|id| {
            env_with(id, |options| {
                options.set("current", current).unwrap();
            })
            .unwrap()
        });
        let mut batches = [envs[0].batch::<f64>(), envs[1].batch::<f64>()];
        for (env, batch) in envs.iter_mut().zip(&mut batches) {
            env.seed(.., &[3; 4]).unwrap();
            env.reset(.., batch).unwrap();
        }
        for step in 0..40 {
            let action: Vec<f64> = (0..8).map(|i| f64::from((7 * step + 3 * i) % 11) / 5.0 - 1.0).collect();
            for (env, batch) in envs.iter_mut().zip(&mut batches) {
                env.step(.., &action, batch).unwrap();
            }
            equal::assert_bits("observations", [batches[0].observations(), batches[1].observations()]);
            equal::assert_bits("reward", [batches[0].reward(), batches[1].reward()]);
        }
    }
    let mut env = env_with(Follow::ID, |options| {
        options.set("limit", 0.0).unwrap();
    })
    .unwrap();
    let mut batch = env.batch::<f64>();
    env.reset(.., &mut batch).unwrap();
    let error = env.step(.., &[0.0f64; 8], &mut batch).unwrap_err();
    assert!(error.message().contains("RustFollow-v0: before_substep: the trunk flies"), "{error}");
}

/// The task tests/Goal-v0 in tests/tasks/groups.cpp written again.
struct Goals {
    target: Carry<2>,
}

impl Task for Goals {
    const ID: &'static str = "tests/RustGoal-v0";
    const MODEL: Model = Model::Text(
        r#"<mujoco><worldbody><body><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><geom size=".1"/>
           </body></worldbody></mujoco>"#,
    );
    const TIME_LIMIT: u64 = 9;

    fn build(b: &mut Builder) -> Result<Self> {
        Ok(Self { target: b.carry() })
    }

    fn reset(&self, start: &mut Start, rng: &mut Rng) -> Result {
        for speed in start.qvel.iter_mut() {
            *speed = rng.uniform(-1.0, 1.0);
        }
        start.carried.set(self.target, [rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)]);
        Ok(())
    }

    fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
        observation.put_all("achieved_goal", sim.qpos());
        observation.put_all("desired_goal", sim.carried(self.target));
        observation.put_all("observation", sim.qvel());
        Ok(())
    }

    fn compute_reward(&self, achieved: &[f64], desired: &[f64]) -> Result<f64> {
        if desired[0] > 9.0 {
            return Err("the goal is out of reach".into());
        }
        Ok(-(achieved[0] - desired[0]).abs() - 2.0 * (achieved[1] - desired[1]).abs())
    }

    fn step(&self, sim: &Sim, _: &mut Row, _: &mut Fields) -> Result<Outcome> {
        Ok(Outcome { reward: self.compute_reward(sim.qpos(), &sim.carried(self.target))?, terminated: false })
    }
}

#[test]
fn rewards_of_goals_equal_those_in_cpp() {
    register::<Goals>().unwrap();
    let folder = std::env::var("MJENV_LIB_DIR").unwrap();
    load_tasks(format!("{folder}/tests/tasks/libgroups.so")).unwrap();
    let mut envs = [Goals::ID, "tests/Goal-v0"].map(|id| env(id).unwrap());
    let mut batches = [envs[0].batch::<f64>(), envs[1].batch::<f64>()];
    for (env, batch) in envs.iter_mut().zip(&mut batches) {
        env.seed(.., &[3; 4]).unwrap();
        env.reset(.., batch).unwrap();
        env.step(.., &[0.0f64; 0], batch).unwrap();
        let goals = |first: usize| (0..4).flat_map(|row| batch.obs(row)[first..first + 2].to_vec()).collect::<Vec<_>>();
        let mut rewards = [0.0; 4];
        env.compute_reward(&goals(0), &goals(2), &mut rewards).unwrap();
        equal::assert_bits("rewards", [&rewards, batch.reward()]);
        env.compute_reward(&[0.0, 1.0], &[0.5, -1.0], &mut rewards[..1]).unwrap();
        assert_eq!(rewards[0], -4.5);
        let error = env.compute_reward(&[0.0, 1.0], &[10.0, 0.0], &mut rewards[..1]).unwrap_err();
        assert!(error.message().contains("compute_reward: the goal is out of reach"), "{error}");
        assert_eq!(env.compute_reward(&[0.0], &[0.0, 1.0], &mut rewards).unwrap_err().kind(), ErrorKind::Size);
        assert_eq!(env.compute_reward(&[0.0], &[0.0], &mut rewards).unwrap_err().kind(), ErrorKind::Size);
    }
    equal::assert_bits("observations", [batches[0].observations(), batches[1].observations()]);
}

/// tests/tasks/terrain.cpp written again.
struct Rolling {
    heights: Own,
    colours: Own,
    field: Array<f32>,
    rgba: Array<f32>,
    ball: usize,
    balls: [usize; 1],
    ground_geom: usize,
    ground: Terrain,
    touched: Carry<1>,
    air: Carry<1>,
}

impl Task for Rolling {
    const ID: &'static str = "tests/RustTerrain-v0";
    const MODEL: Model = Model::Text(include_str!("../../../../../tests/tasks/terrain.xml"));
    const FRAME_SKIP: u32 = 4;
    const TIME_LIMIT: u64 = 25;

    fn build(b: &mut Builder) -> Result<Self> {
        b.current();
        b.random_state();
        b.need("contacts");
        let ground = b.text("ground", "ground", &[], "the geom of the height field");
        Ok(Self {
            heights: b.own("hfield_data"),
            colours: b.own("geom_rgba"),
            field: b.array("hfield_data"),
            rgba: b.array("geom_rgba"),
            ball: b.body("ball"),
            balls: [b.geom("ball")],
            ground_geom: b.geom("ground"),
            ground: b.terrain(&ground)?,
            touched: b.carry(),
            air: b.carry(),
        })
    }

    fn reset(&self, start: &mut Start, rng: &mut Rng) -> Result {
        let order = rng.state_permutation(30);
        for (height, &level) in start.own(self.heights).iter_mut().zip(&order) {
            *height = level as f64 / 30.0;
        }
        rng.state_shuffle(&mut start.own(self.heights)[..7]);
        let colours = start.own(self.colours);
        colours[0] = rng.state_choice(5) as f64 / 10.0;
        colours[4] += 0.01; // counts the resets
        start.qpos[0] = rng.state_uniform(-1.0, 1.0);
        start.forward()?;
        for _ in 0..200 {
            if start.contact_count() > 0 {
                break;
            }
            start.advance(1)?;
        }
        let [x, y, z] = start.see(|sim| sim.xpos()[self.ball]);
        let below = self.ground.height(start, x, y);
        start.carried.set(self.touched, [z - below]);
        start.set_time(0.0);
        Ok(())
    }

    fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
        observation.put_all("qpos", sim.qpos());
        observation.put_all("qvel", sim.qvel());
        observation.put_all("field", sim.array(self.field).iter().map(|&height| f64::from(height)));
        observation.put_all("rgba", sim.array(self.rgba).iter().map(|&colour| f64::from(colour)));
        observation.put_all("touched", sim.carried(self.touched));
        let touching = sim.touching(self.balls, self.ground_geom);
        observation.put_all("touching", touching.map(|touches| f64::from(u8::from(touches))));
        observation.put_all("air", sim.carried(self.air));
        let [x, y, _] = sim.xpos()[self.ball];
        observation.put("below", self.ground.height(sim, x, y));
        observation.put_all("around", self.ground.around(sim, self.ball, &[[0.3, 0.1], [-0.2, 0.4], [9.0, -7.0]]));
        Ok(())
    }

    fn step(&self, sim: &Sim, row: &mut Row, info: &mut Fields) -> Result<Outcome> {
        let at = usize::try_from(row.rng.integers(0, 30)).unwrap();
        row.own(self.heights)[at] = row.rng.random();
        info.put("height", sim.qpos()[2]);
        let mut air = row.carried.get(self.air);
        info.put("flight", air_time(&mut air, sim.touching(self.balls, self.ground_geom), sim.dt())[0]);
        row.carried.set(self.air, air);
        Ok(Outcome { reward: sim.qpos()[0], terminated: false })
    }
}

#[test]
fn own_terrains_equal_those_in_cpp() {
    register::<Rolling>().unwrap();
    let folder = std::env::var("MJENV_LIB_DIR").unwrap();
    load_tasks(format!("{folder}/tests/tasks/libterrain.so")).unwrap();
    let mut envs = [Rolling::ID, "tests/Terrain-v0"].map(|id| env(id).unwrap());
    let mut batches = [envs[0].batch::<f64>(), envs[1].batch::<f64>()];
    let mut landed = false;
    for (env, batch) in envs.iter_mut().zip(&mut batches) {
        env.seed(.., &[3; 4]).unwrap();
        env.reset(.., batch).unwrap();
    }
    for step in 0..24 {
        equal::assert_bits("observations", [batches[0].observations(), batches[1].observations()]);
        let action: Vec<f64> = (0..8).map(|i| f64::from((7 * step + 3 * i) % 11) / 5.0 - 1.0).collect();
        for (env, batch) in envs.iter_mut().zip(&mut batches) {
            env.step(.., &action, batch).unwrap();
        }
        equal::assert_bits("reward", [batches[0].reward(), batches[1].reward()]);
        let flights = [batches[0].info("flight").unwrap(), batches[1].info("flight").unwrap()];
        equal::assert_bits("flight", flights);
        landed |= flights[0].iter().any(|&flight| flight > 0.0);
    }
    assert!(landed);
    let refused = env_with(Rolling::ID, |options| {
        options.set("ground", "ball").unwrap();
    });
    assert!(refused.unwrap_err().to_string().contains("geom \"ball\" is no height field that is fixed"));
}

/// Draws from the row's stream in reset, and writes what it drew.
struct Draws {
    wrong: bool,
    drawn: Carry<16>,
}

impl Task for Draws {
    const ID: &'static str = "Draws-v0";
    const MODEL: Model = Model::Text(MODEL);

    fn build(b: &mut Builder) -> Result<Self> {
        Ok(Self { wrong: b.flag("wrong", false, ""), drawn: b.carry() })
    }

    fn reset(&self, start: &mut Start, rng: &mut Rng) -> Result {
        if self.wrong {
            rng.sample(2, 3);
            return Ok(());
        }
        let mut drawn = vec![rng.random(), rng.uniform(-1.0, 3.0), rng.normal(), rng.integers(-5, 9) as f64];
        drawn.extend([rng.choice(4), rng.choice_weighted(&[0.2, 0.5, 0.3])].map(|index| index as f64));
        drawn.extend(rng.sample(9, 4).iter().chain(&rng.permutation(6)).map(|&index| index as f64));
        start.carried.set(self.drawn, drawn.try_into().unwrap());
        Ok(())
    }

    fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
        observation.put_all("drawn", sim.carried(self.drawn));
        Ok(())
    }

    fn step(&self, _: &Sim, _: &mut Row, _: &mut Fields) -> Result<Outcome> {
        Ok(Outcome { reward: 0.0, terminated: false })
    }
}

#[test]
fn the_random_stream_is_that_of_numpy() {
    register::<Draws>().unwrap();
    let mut env = env(Draws::ID).unwrap();
    let mut batch = env.batch::<f64>();
    env.seed(.., &[7; 4]).unwrap();
    env.reset(.., &mut batch).unwrap();
    // Of numpy.random.default_rng(7): random(), uniform(-1, 3), normal(), integers(-5, 9), choice(4),
    // choice(3, p=[.2, .5, .3]), choice(9, 4, replace=False), permutation(6)
    let drawn = [0.625095466604667, 2.588855203878302, -0.2741378553622176, 6.0, 0.0, 1.0];
    let [sampled, permuted] = [&[0.0, 1.0, 7.0, 6.0][..], &[4.0, 2.0, 0.0, 3.0, 5.0, 1.0]];
    equal::assert_bits("drawn", [&[&drawn[..], sampled, permuted].concat(), batch.obs(3)]);

    let mut env = env_with(Draws::ID, |options| {
        options.set("wrong", true).unwrap();
    })
    .unwrap();
    let error = env.reset(.., &mut batch).unwrap_err();
    assert!(error.message().contains("Draws-v0: reset: sample: size is negative or larger than count"), "{error}");
}

/// numpy.sum of the first numbers of the array in the test.
const SUMS: [(usize, f64); 5] =
    [(0, 0.0), (7, 0.5203663441821337), (8, 0.5560806298964194), (131, 1.4237104503290152), (300, 1.6973030753437544)];

/// Sums of different lengths, which NumPy adds in different orders.
#[test]
fn sums_are_those_of_numpy() {
    let values: Vec<f64> = (0..300).map(|i| 1.0 / f64::from(3 * i + 7)).collect();
    for (count, expected) in SUMS {
        assert_eq!(mjenv::numpy::sum(&values[..count]).to_bits(), f64::to_bits(expected), "{count}");
    }
}

/// Hopper-v5 written again; the test `plugin` compares 1,000 steps.
#[test]
fn a_registered_task_equals_the_built_in_one() {
    register::<Hopper>().unwrap();
    equal::descriptions(Hopper::ID);
    equal::changed_options(Hopper::ID);
    equal::states(Hopper::ID);
}

#[test]
fn tasks_can_be_registered_by_many_threads() {
    wrong! {
        Shared: "Shared-v0", Model::Text(MODEL), 1, |_| ();
    }
    let results: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..8).map(|_| scope.spawn(register::<Shared>)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert_eq!(results.iter().filter(|result| result.is_ok()).count(), 1);
}

#[test]
fn a_file_that_is_no_plug_in_is_refused() {
    let error = load_tasks(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Task);
}

/// Methods under options.
struct Optional {
    maps: bool,
    pushes: bool,
    carries: bool,
    carried: Carry<1>,
}

impl Task for Optional {
    const ID: &'static str = "tests/RustOptional-v0";
    const MODEL: Model = Model::Text(
        r#"<mujoco><worldbody><body><joint name="x" type="slide" axis="1 0 0"/><geom size=".1"/></body></worldbody>
           <actuator><motor joint="x" ctrllimited="true" ctrlrange="-9 9"/></actuator></mujoco>"#,
    );

    fn build(b: &mut Builder) -> Result<Self> {
        Ok(Self {
            maps: b.flag("maps", false, ""),
            pushes: b.flag("pushes", true, ""),
            carries: b.flag("carries", false, ""),
            carried: b.carry(),
        })
    }

    fn reset(&self, _: &mut Start, _: &mut Rng) -> Result {
        Ok(())
    }

    fn carry(&self, _: &Sim, carried: &mut Carried) -> Result {
        if !self.carries {
            return Err(Absent.into());
        }
        carried.set(self.carried, [70.0]);
        Ok(())
    }

    fn before_step(&self, _: &Sim, _: &mut Row, control: &mut Control) -> Result {
        if !self.maps {
            return Err(Absent.into());
        }
        control.set(0, 3.0);
        Ok(())
    }

    fn before_substep(&self, _: &Sim, _: &mut Row, control: &mut Control) -> Result {
        if !self.pushes {
            return Err(Absent.into());
        }
        control.set(0, control.get(0) + 4.0);
        Ok(())
    }

    fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
        observation.put_all("qpos", sim.qpos());
        Ok(())
    }

    fn step(&self, sim: &Sim, row: &mut Row, _: &mut Fields) -> Result<Outcome> {
        Ok(Outcome { reward: sim.ctrl()[0] + row.carried.get(self.carried)[0], terminated: false })
    }
}

#[test]
fn methods_under_options_are_called_where_they_are_on() {
    register::<Optional>().unwrap();
    for chosen in 0..8 {
        let (maps, pushes, carries) = (chosen & 1 != 0, chosen & 2 != 0, chosen & 4 != 0);
        let mut env = env_with(Optional::ID, |options| {
            options.set("maps", maps).unwrap().set("pushes", pushes).unwrap().set("carries", carries).unwrap();
        })
        .unwrap();
        let mut batch = env.batch::<f64>();
        env.reset(.., &mut batch).unwrap();
        env.step(.., &vec![1.0f64; env.rows()], &mut batch).unwrap();
        let ctrl = if maps { 3.0 } else { 1.0 } + if pushes { 4.0 } else { 0.0 };
        assert_eq!(batch.reward()[0], ctrl + if carries { 70.0 } else { 0.0 });
    }
}
