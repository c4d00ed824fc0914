//! Reads the recordings of Gymnasium in tests/golden. Its record.py describes the formats.

use std::fs;
use std::path::{Path, PathBuf};

use mjenv::{Dtype, Options, Value};

pub fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../tests/golden")
}

/// Names the folder of the recordings that fit this CPU, for which the C library chooses variants of its functions.
pub fn libm() -> &'static str {
    // Parsed when the test runs, so that the compiler does not compute the sine.
    let sine = "692".parse::<f64>().unwrap().sin();
    match sine.to_bits() {
        0x3fe8_0869_e3fa_d89a => "fma",
        0x3fe8_0869_e3fa_d899 => "sse2",
        _ => panic!("this C library's sin(692) is {sine}, which belongs to no recording"),
    }
}

/// Parses a number in C99's hexadecimal form or in decimal form.
pub fn real(text: &str) -> f64 {
    let (sign, digits) = text.strip_prefix('-').map_or((1.0, text), |rest| (-1.0, rest));
    let digits = match digits.strip_prefix("0x") {
        Some(digits) => digits,
        None => return text.parse().unwrap(),
    };
    let (mantissa, exponent) = digits.split_once('p').unwrap();
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let mantissa = u64::from_str_radix(&format!("{whole}{fraction}"), 16).unwrap();
    let exponent = exponent.parse::<i32>().unwrap() - 4 * fraction.len() as i32;
    sign * mantissa as f64 * 2f64.powi(exponent)
}

pub fn dtype(name: &str) -> Dtype {
    match name {
        "numpy_float64" => Dtype::Float64,
        "action_dtype" => Dtype::Action,
        "python_float" => Dtype::NativeFloat,
        "python_int" => Dtype::NativeInt,
        "numpy_int64" => Dtype::Int64,
        _ => panic!("no value type {name}"),
    }
}

fn option_value(words: &[&str]) -> Value {
    match words[0] {
        "integer" => Value::Integer(words[1].parse().unwrap()),
        "reals" => Value::Reals(words[1..].iter().map(|word| real(word)).collect()),
        "string" => Value::Text(words[1..].join(" ")),
        kind => panic!("no kind of option {kind}"),
    }
}

#[derive(Debug, PartialEq, Eq)]
pub struct Info {
    pub name: String,
    pub count: usize,
    pub dtype: Dtype,
}

impl Info {
    pub fn parse(words: &[&str]) -> Self {
        Self { name: words[0].to_string(), count: words[1].parse().unwrap(), dtype: dtype(words[2]) }
    }
}

pub struct Array {
    name: String,
    dtype: String,
    width: usize,
    bytes: Vec<u8>,
}

impl Array {
    fn values<const N: usize, T>(&self, dtype: &str, convert: fn([u8; N]) -> T) -> Vec<T> {
        assert_eq!(self.dtype, dtype, "array {}", self.name);
        self.bytes.chunks_exact(N).map(|chunk| convert(chunk.try_into().unwrap())).collect()
    }
}

pub enum Actions {
    Float32(Vec<f32>),
    Float64(Vec<f64>),
}

/// Doubles in rows of `width`. A row of one number stands for several numbers of which it has the hash, as its bits.
pub struct Table {
    width: usize,
    values: Vec<f64>,
}

impl Table {
    pub fn row(&self, index: usize) -> &[f64] {
        &self.values[index * self.width..][..self.width]
    }
}

pub struct Golden {
    folder: PathBuf,
    pub file: String,
    pub machine: String,
    pub id: String,
    pub seed: u64,
    pub norm: String,
    pub options: Vec<(String, Value)>,
    pub info: Vec<Info>,
    pub reset_info: Vec<Info>,
    arrays: Vec<Array>,
}

impl Golden {
    /// Returns the recordings in a folder whose names begin with `prefix`. Panics if there are none.
    pub fn all(name: &str, prefix: &str) -> Vec<Golden> {
        let folder = folder().join(libm()).join(name);
        let mut paths: Vec<_> = fs::read_dir(&folder)
            .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
            .map(|entry| entry.unwrap().path())
            .filter(|path| path.extension().map_or(false, |extension| extension == "golden"))
            .filter(|path| path.file_name().unwrap().to_str().unwrap().starts_with(prefix))
            .collect();
        paths.sort();
        assert!(!paths.is_empty(), "no {prefix}*.golden in {}", folder.display());
        paths.iter().map(|path| Golden::read(path)).collect()
    }

    /// Returns the trajectory of an id with its default options except for the limit of steps.
    pub fn of(id: &str) -> Golden {
        Golden::all("trajectories", &format!("{id}.golden")).remove(0)
    }

    fn read(path: &Path) -> Golden {
        let content = fs::read(path).unwrap();
        let mark = b"\ndata\n";
        let end = content.windows(mark.len()).position(|window| window == mark).unwrap();
        let (text, mut data) = (std::str::from_utf8(&content[..end]).unwrap(), &content[end + mark.len()..]);
        let mut golden = Golden {
            folder: path.parent().unwrap().to_path_buf(),
            file: path.file_name().unwrap().to_str().unwrap().to_string(),
            machine: String::new(),
            id: String::new(),
            seed: 0,
            norm: String::new(),
            options: Vec::new(),
            info: Vec::new(),
            reset_info: Vec::new(),
            arrays: Vec::new(),
        };
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("mjenv-golden 1"));
        for line in lines {
            let (key, rest) = line.split_once(' ').unwrap();
            let words: Vec<_> = rest.split(' ').collect();
            match key {
                "id" => golden.id = rest.to_string(),
                "seed" => golden.seed = rest.parse().unwrap(),
                "norm" => golden.norm = rest.to_string(),
                "option" => golden.options.push((words[0].to_string(), option_value(&words[1..]))),
                "info" => golden.info.push(Info::parse(&words)),
                "reset_info" => golden.reset_info.push(Info::parse(&words)),
                "array" => golden.arrays.push(take_array(&words, &mut data)),
                "gymnasium" | "mujoco" | "numpy" | "python" | "cpu" | "kernel" | "libm" => {
                    golden.machine.push_str(line);
                    golden.machine.push_str(", ");
                }
                _ => panic!("{}: no key {key}", golden.file),
            }
        }
        assert!(data.is_empty(), "{}: {} bytes behind the arrays", golden.file, data.len());
        golden
    }

    pub fn options(&self) -> Options {
        let mut options = Options::new(&self.id).unwrap();
        options.set("norm", self.norm.as_str()).unwrap();
        for (name, value) in &self.options {
            let value = match value {
                Value::Text(file) if file.starts_with('.') => self.folder.join(file).to_str().unwrap().into(),
                other => other.clone(),
            };
            options.set(name, value).unwrap();
        }
        options
    }

    fn array(&self, name: &str) -> &Array {
        self.arrays.iter().find(|array| array.name == name).unwrap()
    }

    pub fn table(&self, name: &str) -> Table {
        let array = self.array(name);
        let dtype = if array.dtype == "u8" { "u8" } else { "f8" };
        Table { width: array.width, values: array.values(dtype, f64::from_le_bytes) }
    }

    pub fn bytes(&self, name: &str) -> Vec<u8> {
        self.array(name).values("u1", |[byte]| byte)
    }

    pub fn flags(&self, name: &str) -> Vec<bool> {
        self.bytes(name).into_iter().map(|byte| byte != 0).collect()
    }

    pub fn integers(&self, name: &str) -> Vec<i64> {
        self.array(name).values("i8", i64::from_le_bytes)
    }

    pub fn reset_at(&self) -> Vec<usize> {
        self.integers("reset_at").into_iter().map(|at| usize::try_from(at).unwrap()).collect()
    }

    pub fn actions(&self) -> Actions {
        let array = self.array("action");
        match array.dtype.as_str() {
            "f4" => Actions::Float32(array.values("f4", f32::from_le_bytes)),
            _ => Actions::Float64(array.values("f8", f64::from_le_bytes)),
        }
    }
}

fn take_array(words: &[&str], data: &mut &[u8]) -> Array {
    let extents: Vec<usize> = words[2..].iter().map(|word| word.parse().unwrap()).collect();
    let item_size: usize = words[1][1..].parse().unwrap();
    let (bytes, rest) = data.split_at(extents.iter().product::<usize>() * item_size);
    *data = rest;
    Array {
        name: words[0].to_string(),
        dtype: words[1].to_string(),
        width: extents.get(1).copied().unwrap_or(1),
        bytes: bytes.to_vec(),
    }
}

fn hash_of(values: &[f64]) -> u64 {
    values.iter().fold(0xcbf2_9ce4_8422_2325, |hash: u64, value| {
        let hash = (hash ^ value.to_bits()).wrapping_mul(0x100_0000_01b3);
        hash ^ (hash >> 32)
    })
}

/// Compares with numbers, or with a row of a [`Table`] that has their hash.
#[track_caller]
pub fn assert_bits(what: &str, got: &[f64], expected: &[f64]) {
    if let ([hash], true) = (expected, got.len() > 1) {
        return assert_eq!(hash_of(got), hash.to_bits(), "{what}: the hash");
    }
    assert_eq!(got.len(), expected.len(), "{what}");
    for (index, (got, expected)) in got.iter().zip(expected).enumerate() {
        assert!(got.to_bits() == expected.to_bits(), "{what}[{index}] is {got:e}, not {expected:e}");
    }
}
