//! Plays a policy that examples/python/train_*.py saved. It needs neither Python nor a learning library.
//!
//!     deploy POLICY [EPISODES [SEED]]        (3 episodes from seed 100)
//!
//! Prints a line for each episode: its length, its return as a hexadecimal float, and a checksum over the bits of all
//! actions. examples/cpp/deploy.cpp, examples/python/deploy.py and examples/julia/deploy.jl print the same.
//! docs/training.md describes the file.

use std::collections::HashMap;
use std::env;
use std::error::Error;
use std::fs;
use std::process::ExitCode;

use mjenv::{Env, Options};

struct Layer {
    inputs: usize,
    squashes: bool, // whether tanh follows
    bias: Vec<f64>,
    weights: Vec<f64>, // [outputs][inputs]
}

impl Layer {
    fn apply(&self, values: &[f64]) -> Vec<f64> {
        let output = |(row, bias): (&[f64], &f64)| {
            let sum = row.iter().zip(values).fold(*bias, |sum, (weight, value)| sum + weight * value);
            if self.squashes {
                sum.tanh()
            } else {
                sum
            }
        };
        self.weights.chunks(self.inputs).zip(&self.bias).map(output).collect()
    }
}

struct Policy {
    id: String,
    numbers: HashMap<String, Vec<f64>>, // mean, scale, clip, low, high
    layers: Vec<Layer>,
}

impl Policy {
    fn load(path: &str) -> Result<Policy, Box<dyn Error>> {
        let text = fs::read_to_string(path).map_err(|error| format!("{path}: {error}"))?;
        let mut lines = text.lines();
        if !matches!(lines.next(), Some("mjenv-policy 1" | "mjenv-policy 2")) {
            return Err(format!("{path}: no policy").into());
        }
        let mut policy = Policy { id: String::new(), numbers: HashMap::new(), layers: Vec::new() };
        for line in lines {
            let mut words = line.split_whitespace();
            match words.next().unwrap_or_default() {
                "id" => policy.id = words.collect(),
                "about" | "input" => {} // what version 2 tells of the environment
                "layer" => policy.layers.push(layer(&words.collect::<Vec<_>>())?),
                name => {
                    let numbers = words.map(str::parse).collect::<Result<Vec<f64>, _>>()?;
                    if name != "bias" && name != "weights" {
                        policy.numbers.insert(name.to_string(), numbers);
                        continue;
                    }
                    let layer = policy.layers.last_mut().ok_or(format!("{name} before a layer"))?;
                    if name == "weights" && numbers.len() != layer.inputs {
                        return Err("a row of weights of another length than the inputs".into());
                    }
                    if name == "bias" { &mut layer.bias } else { &mut layer.weights }.extend(numbers);
                }
            }
        }
        Ok(policy)
    }

    /// Fails unless the sizes of the arrays fit each other and the environment.
    fn check(&self, observations: usize, actions: usize) -> Result<(), String> {
        let mut width = observations;
        for layer in &self.layers {
            if layer.inputs != width || layer.weights.len() != layer.bias.len() * width {
                return Err("layers that do not fit".into());
            }
            width = layer.bias.len();
        }
        if width != actions {
            return Err("the last layer must have as many outputs as an action has numbers".into());
        }
        let sizes = [("mean", observations), ("scale", observations), ("clip", 1), ("low", actions), ("high", actions)];
        for (name, size) in sizes {
            if self.numbers.get(name).map_or(true, |numbers| numbers.len() != size) {
                return Err(format!("{name} is missing or of another length"));
            }
        }
        Ok(())
    }

    fn act(&self, observation: &[f64]) -> Vec<f32> {
        let of = |name: &str| self.numbers[name].iter();
        let clip = self.numbers["clip"][0];
        let mut values: Vec<f64> = observation
            .iter()
            .zip(of("mean").zip(of("scale")))
            .map(|(value, (mean, scale))| ((value - mean) / scale).clamp(-clip, clip))
            .collect();
        for layer in &self.layers {
            values = layer.apply(&values);
        }
        let bounds = of("low").zip(of("high"));
        values.iter().zip(bounds).map(|(value, (low, high))| value.clamp(*low, *high) as f32).collect()
    }
}

fn layer(words: &[&str]) -> Result<Layer, Box<dyn Error>> {
    match words {
        [_, inputs, activation @ ("tanh" | "identity")] => Ok(Layer {
            inputs: inputs.parse()?,
            squashes: *activation == "tanh",
            bias: Vec::new(),
            weights: Vec::new(),
        }),
        [_, _, activation] => Err(format!("unknown activation {activation}").into()),
        _ => Err("a layer has two sizes and an activation".into()),
    }
}

/// A float in the hexadecimal notation of C.
fn hexadecimal(value: f64) -> String {
    let (bits, sign) = (value.to_bits(), if value.is_sign_negative() { "-" } else { "" });
    let (exponent, fraction) = (((bits >> 52) & 0x7ff) as i32, bits & ((1 << 52) - 1));
    if exponent == 0 && fraction == 0 {
        return format!("{sign}0x0p+0");
    }
    let digits = format!("{fraction:013x}");
    let digits = digits.trim_end_matches('0');
    let point = if digits.is_empty() { "" } else { "." };
    let (whole, power) = if exponent == 0 { (0, -1022) } else { (1, exponent - 1023) };
    format!("{sign}0x{whole}{point}{digits}p{power:+}")
}

fn play(policy: &Policy, episodes: usize, seed: u64) -> Result<(), Box<dyn Error>> {
    let mut env = Env::new(&Options::new(&policy.id)?, 1)?;
    let mut batch = env.batch::<f64>();
    policy.check(batch.obs(0).len(), env.action_space().count())?;
    env.seed(.., &[seed])?;
    for _ in 0..episodes {
        env.reset(.., &mut batch)?;
        let (mut length, mut total, mut checksum) = (0, 0.0, 0xcbf2_9ce4_8422_2325_u64);
        while !batch.ended(0) {
            let action = policy.act(batch.obs(0));
            for number in &action {
                checksum = (checksum ^ u64::from(number.to_bits())).wrapping_mul(0x0100_0000_01b3);
            }
            env.step(.., &action, &mut batch)?;
            total += batch.reward()[0];
            length += 1;
        }
        println!("{length} {} {checksum:016x}", hexadecimal(total));
    }
    Ok(())
}

fn run(arguments: &[String]) -> Result<(), Box<dyn Error>> {
    let policy = Policy::load(&arguments[0])?;
    let episodes = arguments.get(1).map_or(Ok(3), |word| word.parse())?;
    let seed = arguments.get(2).map_or(Ok(100), |word| word.parse())?;
    play(&policy, episodes, seed)
}

fn main() -> ExitCode {
    let arguments: Vec<_> = env::args().skip(1).collect();
    if arguments.is_empty() || arguments.len() > 3 {
        eprintln!("deploy POLICY [EPISODES [SEED]]");
        return ExitCode::from(2);
    }
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("deploy: {error}");
            ExitCode::FAILURE
        }
    }
}
