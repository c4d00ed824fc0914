//! Replaces libmjenv, because Miri cannot run C. It has the functions that the crate calls. Its physics are sums, and
//! each row that is sent gets a thread. It reads and writes everything that the header allows the library to read and
//! write.

use std::ffi::CStr;
use std::os::raw::{c_char, c_void};
use std::slice;
use std::thread::{self, JoinHandle};

use mjenv_sys::*;

const ACTUATORS: usize = 2;
/// The name and the number of elements of each field, which are the same for every role.
const FIELDS: [(&[u8], usize); 2] = [(b"place\0", 2), (b"speed\0", 1)];
const ELEMENTS: usize = 3;
/// With this num_threads all rows that are sent fail because there is not enough memory.
pub const SHORT_OF_MEMORY: i64 = 99;
const OPTIONS: [(&[u8], mjenv_kind); 4] = [
    (b"num_threads\0", MJENV_KIND_INTEGER),
    (b"strict\0", MJENV_KIND_FLAG),
    (b"range\0", MJENV_KIND_REALS),
    (b"autoreset_mode\0", MJENV_KIND_STRING),
];
static BOUNDS: [f64; ELEMENTS] = [1.0; ELEMENTS];

struct Options {
    threads: i64,
    range: [f64; 2],
    mode: Vec<u8>,
}

struct Env {
    options: Options,
    state: Vec<f64>,
    sent: Vec<(i64, JoinHandle<f64>)>,
}

fn text(of: &'static [u8]) -> *const c_char {
    of.as_ptr() as *const c_char
}

unsafe fn env_of<'a>(env: *mut mjenv_env) -> &'a mut Env {
    &mut *(env as *mut Env)
}

unsafe fn options_of<'a>(options: *const mjenv_options) -> &'a Options {
    &*(options as *const Options)
}

unsafe fn options_mut<'a>(options: *mut mjenv_options) -> &'a mut Options {
    &mut *(options as *mut Options)
}

unsafe fn option_of(name: *const c_char) -> Option<usize> {
    let name = CStr::from_ptr(name).to_bytes_with_nul();
    OPTIONS.iter().position(|option| option.0 == name)
}

#[no_mangle]
extern "C" fn mjenv_abi_version() -> u32 {
    MJENV_ABI_VERSION
}

#[no_mangle]
extern "C" fn mjenv_last_error() -> *const c_char {
    text(b"no such thing\0")
}

#[no_mangle]
unsafe extern "C" fn mjenv_spec_of(_: *const c_char, spec: *mut mjenv_spec) -> mjenv_status {
    (*spec).id = text(b"Fake-v5\0");
    (*spec).robot = text(b"Fake\0");
    MJENV_OK
}

// ---- Options ----

#[no_mangle]
unsafe extern "C" fn mjenv_options_create(_: *const c_char, options: *mut *mut mjenv_options) -> mjenv_status {
    let made = Options { threads: 1, range: [-1.0, 1.0], mode: b"same_step\0".to_vec() };
    *options = Box::into_raw(Box::new(made)) as *mut mjenv_options;
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_options_destroy(options: *mut mjenv_options) {
    drop(Box::from_raw(options as *mut Options));
}

#[no_mangle]
extern "C" fn mjenv_options_count(_: *const mjenv_options) -> i64 {
    OPTIONS.len() as i64
}

#[no_mangle]
unsafe extern "C" fn mjenv_options_at(_: *const mjenv_options, index: i64, option: *mut mjenv_option) -> mjenv_status {
    let (name, kind) = OPTIONS[index as usize];
    let option = &mut *option;
    (option.name, option.doc, option.kind, option.count) = (text(name), text(b"\0"), kind as i32, 1);
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_options_set_integer(
    options: *mut mjenv_options,
    name: *const c_char,
    value: i64,
) -> mjenv_status {
    if option_of(name).is_none() {
        return MJENV_E_NAME;
    }
    options_mut(options).threads = value;
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_options_set_reals(
    options: *mut mjenv_options,
    _: *const c_char,
    values: *const f64,
    count: i64,
) -> mjenv_status {
    options_mut(options).range.copy_from_slice(slice::from_raw_parts(values, count as usize));
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_options_set_string(
    options: *mut mjenv_options,
    _: *const c_char,
    value: *const c_char,
) -> mjenv_status {
    options_mut(options).mode = CStr::from_ptr(value).to_bytes_with_nul().to_vec();
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_options_get_integer(
    options: *const mjenv_options,
    name: *const c_char,
    value: *mut i64,
) -> mjenv_status {
    match option_of(name) {
        Some(0 | 1) => *value = options_of(options).threads,
        _ => return MJENV_E_NAME,
    }
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_options_get_reals(
    options: *const mjenv_options,
    _: *const c_char,
    values: *mut f64,
    capacity: i64,
    count: *mut i64,
) -> mjenv_status {
    let range = options_of(options).range;
    *count = range.len() as i64;
    if capacity > 0 {
        slice::from_raw_parts_mut(values, capacity as usize).copy_from_slice(&range);
    }
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_options_get_string(
    options: *const mjenv_options,
    _: *const c_char,
    value: *mut *const c_char,
) -> mjenv_status {
    *value = options_of(options).mode.as_ptr() as *const c_char;
    MJENV_OK
}

// ---- Environments ----

#[no_mangle]
unsafe extern "C" fn mjenv_create(options: *const mjenv_options, rows: i64, env: *mut *mut mjenv_env) -> mjenv_status {
    let given = options_of(options);
    let copy = Options { threads: given.threads, range: given.range, mode: given.mode.clone() };
    let made = Env { options: copy, state: vec![0.0; rows as usize], sent: Vec::new() };
    *env = Box::into_raw(Box::new(made)) as *mut mjenv_env;
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_destroy(env: *mut mjenv_env) {
    let env = Box::from_raw(env as *mut Env);
    for (_, thread) in env.sent {
        thread.join().unwrap();
    }
}

#[no_mangle]
unsafe extern "C" fn mjenv_info_of(_: *mut mjenv_env, info: *mut mjenv_info) -> mjenv_status {
    (*info).frame_skip = 5;
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_space_of(_: *const mjenv_env, role: mjenv_role, space: *mut mjenv_space) -> mjenv_status {
    let space = &mut *space;
    space.count = if role == MJENV_ROLE_ACTION { ACTUATORS } else { ELEMENTS } as i64;
    (space.low, space.high) = (BOUNDS.as_ptr(), BOUNDS.as_ptr());
    MJENV_OK
}

#[no_mangle]
extern "C" fn mjenv_field_count(_: *const mjenv_env, _: mjenv_role) -> i64 {
    FIELDS.len() as i64
}

#[no_mangle]
unsafe extern "C" fn mjenv_field_at(
    _: *const mjenv_env,
    _: mjenv_role,
    index: i64,
    field: *mut mjenv_field,
) -> mjenv_status {
    let (name, count) = FIELDS[index as usize];
    let field = &mut *field;
    (field.name, field.doc, field.dtype) = (text(name), text(b"\0"), MJENV_DTYPE_FLOAT64 as i32);
    (field.offset, field.count) = (index * 2, count as i64);
    (field.ndim, field.shape[0]) = (1, count as i64);
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_object_name(
    _: *const mjenv_env,
    _: *const c_char,
    _: i64,
    name: *mut *const c_char,
) -> mjenv_status {
    *name = text(b"torso\xff\0");
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_read(
    _: *mut mjenv_env,
    row: i64,
    _: *const c_char,
    values: *mut f64,
    capacity: i64,
    count: *mut i64,
) -> mjenv_status {
    *count = ELEMENTS as i64;
    slice::from_raw_parts_mut(values, capacity as usize).fill(row as f64);
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_snapshot(
    env: *mut mjenv_env,
    row: i64,
    image: *mut c_void,
    capacity: i64,
    size: *mut i64,
) -> mjenv_status {
    *size = 8;
    if !image.is_null() {
        let state = env_of(env).state[row as usize];
        slice::from_raw_parts_mut(image as *mut u8, capacity as usize).copy_from_slice(&state.to_ne_bytes());
    }
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_restore(env: *mut mjenv_env, row: i64, image: *const c_void, size: i64) -> mjenv_status {
    match slice::from_raw_parts(image as *const u8, size as usize).try_into() {
        Ok(bytes) => env_of(env).state[row as usize] = f64::from_ne_bytes(bytes),
        Err(_) => return MJENV_E_SNAPSHOT,
    }
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_sample_actions(_: *mut mjenv_env, action: *mut f32, count: i64) -> mjenv_status {
    slice::from_raw_parts_mut(action, count as usize).fill(0.5);
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_reset(env: *mut mjenv_env, mask: *const u8, out: *const mjenv_batch) -> mjenv_status {
    for (row, state) in env_of(env).state.iter_mut().enumerate() {
        if mask.is_null() || *mask.add(row) != 0 {
            *state = 0.0;
            write(&*out, row, *state);
        }
    }
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_step(
    env: *mut mjenv_env,
    mask: *const u8,
    action: *const c_void,
    count: i64,
    dtype: mjenv_dtype,
    out: *const mjenv_batch,
) -> mjenv_status {
    let state = &mut env_of(env).state;
    if count as usize != state.len() * ACTUATORS {
        return MJENV_E_SIZE;
    }
    let sums = sums(action, count, dtype);
    for (row, state) in state.iter_mut().enumerate() {
        if mask.is_null() || *mask.add(row) != 0 {
            *state += sums[row];
            write(&*out, row, *state);
        }
    }
    MJENV_OK
}

// ---- Steps in two halves ----

#[no_mangle]
unsafe extern "C" fn mjenv_send(
    env: *mut mjenv_env,
    rows: *const i64,
    row_count: i64,
    action: *const c_void,
    count: i64,
    dtype: mjenv_dtype,
) -> mjenv_status {
    let env = env_of(env);
    let all: Vec<i64> = (0..env.state.len() as i64).collect();
    let rows = if rows.is_null() { &all[..] } else { slice::from_raw_parts(rows, row_count as usize) };
    if count as usize != rows.len() * ACTUATORS {
        return MJENV_E_SIZE;
    }
    if rows.iter().any(|row| env.sent.iter().any(|sent| sent.0 == *row)) {
        return MJENV_E_PENDING;
    }
    for (&row, sum) in rows.iter().zip(sums(action, count, dtype)) {
        env.state[row as usize] += sum;
        let state = env.state[row as usize];
        let work = move || {
            thread::yield_now();
            state
        };
        env.sent.push((row, thread::spawn(work)));
    }
    MJENV_OK
}

#[no_mangle]
unsafe extern "C" fn mjenv_recv(
    env: *mut mjenv_env,
    least: i64,
    _: f64,
    rows: *mut i64,
    _: i64,
    count: *mut i64,
    out: *const mjenv_batch,
) -> mjenv_status {
    let env = env_of(env);
    if env.sent.is_empty() {
        return MJENV_E_NOT_PENDING;
    }
    *count = least;
    for (i, (row, thread)) in env.sent.drain(..least as usize).enumerate() {
        write(&*out, row as usize, thread.join().unwrap());
        *rows.add(i) = row;
    }
    if env.options.threads == SHORT_OF_MEMORY {
        return MJENV_E_MEMORY;
    }
    MJENV_OK
}

// ---- Actions and outputs ----

/// Returns the sum of each row's actions.
unsafe fn sums(action: *const c_void, count: i64, dtype: mjenv_dtype) -> Vec<f64> {
    let actions: Vec<f64> = if dtype == MJENV_DTYPE_FLOAT32 {
        slice::from_raw_parts(action as *const f32, count as usize).iter().map(|&a| a.into()).collect()
    } else {
        slice::from_raw_parts(action as *const f64, count as usize).to_vec()
    };
    actions.chunks(ACTUATORS).map(|row| row.iter().sum()).collect()
}

/// Writes all outputs of a row.
unsafe fn write(out: &mjenv_batch, row: usize, state: f64) {
    observe(out, out.obs, row, state);
    *out.reward.add(row) = state;
    *out.terminated.add(row) = (state > 3.0) as u8;
    *out.truncated.add(row) = 0;
    *out.status.add(row) = MJENV_OK;
    *out.was_reset.add(row) = (state > 3.0) as u8;
    for values in [out.info, out.reset_info, out.arrays, out.final_info] {
        record(out, values, row, state);
    }
    if !out.final_obs.is_null() {
        observe(out, out.final_obs, row, state);
    }
}

unsafe fn observe(out: &mjenv_batch, to: *mut c_void, row: usize, state: f64) {
    for element in row * ELEMENTS..(row + 1) * ELEMENTS {
        if out.obs_dtype == MJENV_DTYPE_FLOAT32 {
            *(to as *mut f32).add(element) = state as f32;
        } else {
            *(to as *mut f64).add(element) = state;
        }
    }
}

/// Writes a row's values of all fields. Each field holds its elements of all rows.
unsafe fn record(out: &mjenv_batch, values: *mut f64, row: usize, state: f64) {
    if values.is_null() {
        return;
    }
    let mut start = 0;
    for (_, count) in FIELDS {
        for element in 0..count {
            *values.add(start + row * count + element) = state;
        }
        start += count * out.rows as usize;
    }
}
