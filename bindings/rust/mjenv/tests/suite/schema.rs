//! Compares what the library declares with what Gymnasium declares.

use std::fs;

use mjenv::{Dtype, Env, ErrorKind, Kind, Options, Role, Space, Value};

use crate::golden::{dtype, folder, real, Info};
use crate::replay::described;

/// The lines of an id in schema.txt. Each line is a key followed by words.
struct Section<'a>(Vec<Vec<&'a str>>);

impl<'a> Section<'a> {
    fn rows<'b>(&'b self, key: &'static str) -> impl Iterator<Item = &'b [&'a str]> {
        self.0.iter().filter(move |words| words[0] == key).map(|words| &words[1..])
    }

    fn one(&self, key: &'static str) -> &str {
        self.rows(key).next().unwrap()[0]
    }

    fn space(&self, key: &'static str, role: &str) -> &[&'a str] {
        &self.rows(key).find(|words| words[0] == role).unwrap()[1..]
    }

    fn infos(&self, key: &'static str) -> Vec<Info> {
        self.rows(key).map(Info::parse).collect()
    }
}

fn sections(text: &str) -> Vec<Section<'_>> {
    let mut sections: Vec<Section> = Vec::new();
    for line in text.lines() {
        let words: Vec<_> = line.split(' ').collect();
        if words[0] == "id" {
            sections.push(Section(Vec::new()));
        }
        if let Some(section) = sections.last_mut() {
            section.0.push(words);
        }
    }
    sections
}

fn default_of(words: &[&str]) -> (Kind, Value) {
    match words[0] {
        "flag" => (Kind::Flag, Value::Flag(words[1] == "1")),
        "integer" => (Kind::Integer, Value::Integer(words[1].parse().unwrap())),
        "reals" => (Kind::Reals, Value::Reals(words[1..].iter().map(|word| real(word)).collect())),
        "string" => (Kind::String, Value::Text(words[1].to_string())),
        "string_or_int" => (Kind::StringOrInteger, Value::Integer(words[1].parse().unwrap())),
        kind => panic!("no kind of option {kind}"),
    }
}

fn check_space(space: Space<'_>, section: &Section<'_>, role: &str) {
    let declared = section.space("space", role);
    assert_eq!(space.dtype, if declared[0] == "float32" { Dtype::Float32 } else { Dtype::Float64 });
    assert_eq!(space.count(), declared[1].parse::<usize>().unwrap());
    for (bound, key) in [(space.low, "low"), (space.high, "high")] {
        let words = section.space(key, role);
        let expected: Vec<_> = (0..space.count()).map(|i| real(words[if words.len() == 1 { 0 } else { i }])).collect();
        assert_eq!(bound, expected, "{key} {role}");
    }
}

#[test]
fn every_id_is_declared_as_gymnasium_declares_it() {
    let text = fs::read_to_string(folder().join("schema.txt")).unwrap();
    let sections = sections(&text);
    assert_eq!(sections.iter().map(|section| section.one("id")).collect::<Vec<_>>(), mjenv::ids().collect::<Vec<_>>());
    for section in &sections {
        let id = section.one("id");
        let spec = mjenv::spec(id).unwrap();
        assert_eq!(format!("{}-v{}", spec.robot, spec.version), id);
        assert_eq!(spec.id, id);
        assert_eq!(spec.max_episode_steps.to_string(), section.one("max_episode_steps"));
        let threshold = Some(section.one("reward_threshold")).filter(|text| *text != "none").map(real);
        assert_eq!(spec.reward_threshold, threshold, "{id}");

        let options = Options::new(id).unwrap();
        for (words, option) in section.rows("option").zip(options.schema()) {
            let (kind, default) = default_of(&words[1..]);
            assert_eq!((option.name, option.kind), (words[0], kind), "{id}");
            assert_eq!(options.value(option.name).unwrap(), default, "{id} {}", option.name);
        }

        let env = Env::new(&options, 2).unwrap();
        assert_eq!(env.spec(), spec);
        assert_eq!(env.frame_skip().to_string(), section.one("frame_skip"));
        check_space(env.observation_space(), section, "observation");
        check_space(env.action_space(), section, "action");
        assert_eq!(described(&env, Role::Info), section.infos("info"), "{id}");
        assert_eq!(described(&env, Role::ResetInfo), section.infos("reset_info"), "{id}");
        let reward: Vec<_> = env.fields(Role::Reward).map(|field| field.dtype).collect();
        assert_eq!(reward, [dtype(section.one("reward"))], "{id}");
        let structure: Vec<_> = section.rows("structure").map(|words| (words[0], words[1])).collect();
        let fields: Vec<_> = env.fields(Role::Structure).map(|f| (f.name.into_owned(), f.count.to_string())).collect();
        assert_eq!(fields.iter().map(|(name, count)| (&name[..], &count[..])).collect::<Vec<_>>(), structure, "{id}");
    }
}

#[test]
fn fields_tell_where_their_elements_are() {
    let env = Env::new(&Options::new("Humanoid-v5").unwrap(), 1).unwrap();
    for (role, total) in [(Role::Observation, 348), (Role::Action, 17)] {
        let mut offset = 0;
        for field in env.fields(role) {
            assert_eq!(field.offset, offset);
            assert_eq!(field.shape().iter().product::<usize>(), field.count);
            offset += field.count;
        }
        assert_eq!(offset, total);
    }
    assert!(env.fields(Role::Action).all(|actuator| actuator.shape().is_empty()));
    let xpos = env.fields(Role::Data).find(|field| field.name == "xpos").unwrap();
    assert_eq!((xpos.shape(), xpos.dtype), (&[14, 3][..], Dtype::Float64));
    let names = env.fields(Role::Model).find(|field| field.name == "geom_rgba").unwrap();
    assert_eq!(names.dtype, Dtype::Float32);
}

#[test]
fn options_read_back_as_they_were_set() {
    let mut options = Options::new("Ant-v5").unwrap();
    options.set("xml_file", "./é.xml").unwrap().set("frame_skip", 3).unwrap();
    options.set("healthy_reward", 2).unwrap().set("ctrl_cost_weight", 0.1).unwrap();
    options.set("healthy_z_range", [f64::NEG_INFINITY, 2.5]).unwrap();
    options.set("contact_force_range", vec![-3.0, 3.0]).unwrap();
    options.set("main_body", "torso").unwrap().set("terminate_when_unhealthy", false).unwrap();
    assert_eq!(options.get::<String>("xml_file").unwrap(), "./é.xml");
    assert_eq!(options.get::<i64>("frame_skip").unwrap(), 3);
    assert_eq!(options.get::<f64>("healthy_reward").unwrap(), 2.0);
    assert_eq!(options.get::<f64>("ctrl_cost_weight").unwrap(), 0.1);
    assert_eq!(options.get::<Vec<f64>>("healthy_z_range").unwrap(), [f64::NEG_INFINITY, 2.5]);
    assert_eq!(options.get::<Vec<f64>>("contact_force_range").unwrap(), [-3.0, 3.0]);
    assert_eq!(options.value("main_body").unwrap(), Value::Text("torso".to_string()));
    assert!(!options.get::<bool>("terminate_when_unhealthy").unwrap());
    assert_eq!(options.set("main_body", 2).unwrap().value("main_body").unwrap(), Value::Integer(2));
    assert_eq!(options.get::<i64>("ctrl_cost_weight").unwrap_err().kind(), ErrorKind::Type);

    let norm = options.schema().find(|option| option.name == "norm").unwrap();
    assert_eq!(norm.choices().collect::<Vec<_>>(), ["auto", "fused", "plain"]);
    let range = options.schema().find(|option| option.name == "healthy_z_range").unwrap();
    assert_eq!((range.count, range.low, range.high), (2, f64::NEG_INFINITY, f64::INFINITY));
    assert_eq!(range.choices().count(), 0);
}

#[test]
fn an_environment_keeps_a_copy_of_its_options() {
    let mut options = Options::new("Hopper-v5").unwrap();
    let env = Env::new(options.set("frame_skip", 9).unwrap(), 1).unwrap();
    options.set("frame_skip", 1).unwrap();
    drop(options);
    assert_eq!(env.options().get::<i64>("frame_skip").unwrap(), 9);
    assert!(format!("{env:?}").contains("frame_skip: Integer(9)"));
}

#[test]
fn an_integer_weight_makes_gymnasiums_int() {
    let mut options = Options::new("Hopper-v5").unwrap();
    let survive = |options: &Options| {
        let env = Env::new(options, 1).unwrap();
        let field = env.fields(Role::Info).find(|field| field.name == "reward_survive").unwrap();
        field.dtype
    };
    assert_eq!(survive(options.set("healthy_reward", 1.0).unwrap()), Dtype::NativeFloat);
    assert_eq!(survive(options.set("healthy_reward", 1).unwrap()), Dtype::NativeInt);
}

#[test]
fn the_version_names_mujoco() {
    assert_eq!(mjenv::version(), format!("{} (MuJoCo 2.2.2)", env!("CARGO_PKG_VERSION")));
}
