// The C interface in WebAssembly. Written by tools/declarations.py from mjenv.h: do not edit.

/**
 * @typedef {"uint8" | "int32" | "uint32" | "int64" | "uint64" | "float32" | "float64"} Scalar
 * @typedef {{ readonly offset: number; readonly type: Scalar; readonly length: number }} Member
 */

/**
 * @template {Record<string, Member>} const Members
 * @param {number} size
 * @param {Members} members
 */
function struct(size, members) {
  return Object.freeze({ size, members });
}

export const MJENV_ABI_VERSION = 1;
export const MJENV_ALL_ROWS = -1;
export const MJENV_BODY_UNSET = -2;

export const Status = /** @type {const} */ ({
  OK: 0,
  DIVERGED: 1,
  E_ARGUMENT: -1,
  E_NAME: -2,
  E_TYPE: -3,
  E_VALUE: -4,
  E_SIZE: -5,
  E_NOT_RESET: -6,
  E_EPISODE_ENDED: -7,
  E_PENDING: -8,
  E_NOT_PENDING: -9,
  E_BUSY: -10,
  E_FORKED: -11,
  E_FILE: -12,
  E_MODEL: -13,
  E_PHYSICS: -14,
  E_SNAPSHOT: -15,
  E_RENDER: -16,
  E_MEMORY: -17,
  E_INTERNAL: -18,
  E_TASK: -19,
});

export const Distribution = /** @type {const} */ ({
  UNIFORM: 0,
  NORMAL: 1,
  INTEGERS: 2,
});

export const Dtype = /** @type {const} */ ({
  FLOAT64: 1,
  FLOAT32: 2,
  INT64: 3,
  INT32: 4,
  UINT8: 5,
  ACTION: 6,
  NATIVE_FLOAT: 7,
  NATIVE_INT: 8,
});

export const Role = /** @type {const} */ ({
  OBSERVATION: 1,
  ACTION: 2,
  INFO: 3,
  RESET_INFO: 4,
  REWARD: 5,
  STRUCTURE: 6,
  DATA: 7,
  MODEL: 8,
  ARRAYS: 9,
  PARAMETERS: 10,
  GROUPS: 11,
});

export const Kind = /** @type {const} */ ({
  FLAG: 1,
  INTEGER: 2,
  REALS: 3,
  STRING: 4,
  STRING_OR_INT: 5,
});

export const Label = /** @type {const} */ ({
  NONE: 0,
  BODY: 1,
  JOINT: 2,
  GEOM: 3,
  SITE: 4,
  CAMERA: 5,
  LIGHT: 6,
  TENDON: 7,
  ACTUATOR: 8,
  CONSTRAINT: 9,
  SKIN: 10,
  SELECTION: 11,
  SELPNT: 12,
  CONTACTFORCE: 13,
});

export const Frame = /** @type {const} */ ({
  NONE: 0,
  BODY: 1,
  GEOM: 2,
  SITE: 3,
  CAMERA: 4,
  LIGHT: 5,
  CONTACT: 6,
  WORLD: 7,
});

export const mjenv_option = struct(48, {
  struct_size: { offset: 0, type: "uint32", length: 0 },
  kind: { offset: 4, type: "int32", length: 0 },
  name: { offset: 8, type: "uint32", length: 0 },
  doc: { offset: 12, type: "uint32", length: 0 },
  low: { offset: 16, type: "float64", length: 0 },
  high: { offset: 24, type: "float64", length: 0 },
  count: { offset: 32, type: "int64", length: 0 },
  choices: { offset: 40, type: "uint32", length: 0 },
});

export const mjenv_field = struct(72, {
  struct_size: { offset: 0, type: "uint32", length: 0 },
  ndim: { offset: 4, type: "int32", length: 0 },
  name: { offset: 8, type: "uint32", length: 0 },
  doc: { offset: 12, type: "uint32", length: 0 },
  shape: { offset: 16, type: "int64", length: 4 },
  offset: { offset: 48, type: "int64", length: 0 },
  count: { offset: 56, type: "int64", length: 0 },
  dtype: { offset: 64, type: "int32", length: 0 },
  reserved: { offset: 68, type: "int32", length: 0 },
});

export const mjenv_space = struct(64, {
  struct_size: { offset: 0, type: "uint32", length: 0 },
  dtype: { offset: 4, type: "int32", length: 0 },
  count: { offset: 8, type: "int64", length: 0 },
  low: { offset: 16, type: "uint32", length: 0 },
  high: { offset: 20, type: "uint32", length: 0 },
  ndim: { offset: 24, type: "int32", length: 0 },
  reserved: { offset: 28, type: "int32", length: 0 },
  shape: { offset: 32, type: "int64", length: 4 },
});

export const mjenv_info = struct(40, {
  struct_size: { offset: 0, type: "uint32", length: 0 },
  threads: { offset: 4, type: "int32", length: 0 },
  rows: { offset: 8, type: "int64", length: 0 },
  frame_skip: { offset: 16, type: "int64", length: 0 },
  lanes: { offset: 24, type: "int64", length: 0 },
  lanes_reason: { offset: 32, type: "uint32", length: 0 },
});

export const mjenv_spec = struct(88, {
  struct_size: { offset: 0, type: "uint32", length: 0 },
  version: { offset: 4, type: "int32", length: 0 },
  id: { offset: 8, type: "uint32", length: 0 },
  robot: { offset: 12, type: "uint32", length: 0 },
  max_episode_steps: { offset: 16, type: "int64", length: 0 },
  reward_threshold: { offset: 24, type: "float64", length: 0 },
  camera_distance: { offset: 32, type: "float64", length: 0 },
  camera_elevation: { offset: 40, type: "float64", length: 0 },
  camera_lookat: { offset: 48, type: "float64", length: 3 },
  camera_trackbodyid: { offset: 72, type: "int32", length: 0 },
  revision: { offset: 76, type: "int32", length: 0 },
  model_xml: { offset: 80, type: "uint32", length: 0 },
});

export const mjenv_batch = struct(96, {
  struct_size: { offset: 0, type: "uint32", length: 0 },
  obs_dtype: { offset: 4, type: "int32", length: 0 },
  rows: { offset: 8, type: "int64", length: 0 },
  obs_count: { offset: 16, type: "int64", length: 0 },
  info_count: { offset: 24, type: "int64", length: 0 },
  reset_info_count: { offset: 32, type: "int64", length: 0 },
  arrays_count: { offset: 40, type: "int64", length: 0 },
  obs: { offset: 48, type: "uint32", length: 0 },
  reward: { offset: 52, type: "uint32", length: 0 },
  terminated: { offset: 56, type: "uint32", length: 0 },
  truncated: { offset: 60, type: "uint32", length: 0 },
  status: { offset: 64, type: "uint32", length: 0 },
  info: { offset: 68, type: "uint32", length: 0 },
  was_reset: { offset: 72, type: "uint32", length: 0 },
  reset_info: { offset: 76, type: "uint32", length: 0 },
  final_obs: { offset: 80, type: "uint32", length: 0 },
  final_info: { offset: 84, type: "uint32", length: 0 },
  arrays: { offset: 88, type: "uint32", length: 0 },
});

/**
 * The library's functions. Pointers are addresses in the library's memory.
 *
 * @typedef {object} Functions
 * @property {() => number} mjenv_abi_version
 * @property {() => number} mjenv_version
 * @property {(status: number) => number} mjenv_status_name
 * @property {() => number} mjenv_last_error
 * @property {(handle: number, text: number, capacity: bigint, size: number) => number} mjenv_error_of
 * @property {() => bigint} mjenv_id_count
 * @property {(index: bigint) => number} mjenv_id_at
 * @property {(id: number, spec: number) => number} mjenv_spec_of
 * @property {(id: number, options: number) => number} mjenv_options_create
 * @property {(options: number, copy: number) => number} mjenv_options_copy
 * @property {(options: number) => void} mjenv_options_destroy
 * @property {(options: number) => bigint} mjenv_options_count
 * @property {(options: number, index: bigint, option: number) => number} mjenv_options_at
 * @property {(options: number, name: number, value: bigint) => number} mjenv_options_set_integer
 * @property {(options: number, name: number, values: number, count: bigint) => number} mjenv_options_set_reals
 * @property {(options: number, name: number, value: number) => number} mjenv_options_set_string
 * @property {(options: number, name: number, value: number) => number} mjenv_options_get_integer
 * @property {(options: number, name: number, values: number, capacity: bigint, count: number) => number} mjenv_options_get_reals
 * @property {(options: number, name: number, value: number) => number} mjenv_options_get_string
 * @property {(options: number, rows: bigint, env: number) => number} mjenv_create
 * @property {(env: number) => void} mjenv_destroy
 * @property {(env: number, info: number) => number} mjenv_info_of
 * @property {(env: number) => number} mjenv_lane_stages_of
 * @property {(env: number) => number} mjenv_options_of
 * @property {(env: number, role: number, space: number) => number} mjenv_space_of
 * @property {(env: number, role: number) => bigint} mjenv_field_count
 * @property {(env: number, role: number, index: bigint, field: number) => number} mjenv_field_at
 * @property {(env: number, mask: number, seeds: number, count: bigint) => number} mjenv_seed
 * @property {(env: number, row: bigint, words: number, count: bigint) => number} mjenv_seed_row
 * @property {(env: number, row: bigint, words: number, count: bigint) => number} mjenv_get_stream
 * @property {(env: number, row: bigint, words: number, count: bigint) => number} mjenv_set_stream
 * @property {(words: number, streams: bigint, kind: number, low: number, high: number, values: number, count: bigint) => number} mjenv_draw
 * @property {(env: number, seed: bigint) => number} mjenv_seed_actions
 * @property {(env: number, action: number, count: bigint) => number} mjenv_sample_actions
 * @property {(env: number, mask: number, out: number) => number} mjenv_reset
 * @property {(env: number, mask: number, action: number, count: bigint, dtype: number, out: number) => number} mjenv_step
 * @property {(env: number, rows: number, row_count: bigint, action: number, count: bigint, dtype: number) => number} mjenv_send
 * @property {(env: number, least: bigint, timeout: number, rows: number, capacity: bigint, count: number, out: number) => number} mjenv_recv
 * @property {(env: number, action: number, count: bigint, dtype: number, steps: bigint, out: number) => number} mjenv_rollout
 * @property {(env: number, out: number) => number} mjenv_observe
 * @property {(env: number, row: bigint, out: number) => number} mjenv_observe_row
 * @property {(env: number, mask: number, qpos: number, nq: bigint, qvel: number, nv: bigint, out: number) => number} mjenv_begin
 * @property {(env: number, mask: number, action: number, count: bigint, dtype: number, seen: number) => number} mjenv_act
 * @property {(env: number, mask: number, action: number, count: bigint, dtype: number, ctrl: number, ctrl_count: bigint, out: number) => number} mjenv_advance
 * @property {(env: number, mask: number, given: number, out: number) => number} mjenv_finish
 * @property {(env: number, achieved: number, desired: number, count: bigint, rewards: number, reward_count: bigint) => number} mjenv_compute_reward
 * @property {(env: number, row: bigint, array: number, values: number, capacity: bigint, count: number) => number} mjenv_read
 * @property {(env: number, row: bigint, array: number, values: number, bytes: bigint) => number} mjenv_mirror
 * @property {(env: number, type: number, count: number) => number} mjenv_object_count
 * @property {(env: number, type: number, name: number, index: number) => number} mjenv_object_index
 * @property {(env: number, type: number, index: bigint, name: number) => number} mjenv_object_name
 * @property {(env: number, row: bigint, qpos: number, nq: bigint, qvel: number, nv: bigint) => number} mjenv_set_state
 * @property {(env: number, mask: number) => number} mjenv_reset_data
 * @property {(env: number, mask: number, array: number, values: number, count: bigint) => number} mjenv_write
 * @property {(env: number, row: bigint, array: number, values: number, count: bigint) => number} mjenv_write_row
 * @property {(env: number, mask: number) => number} mjenv_set_constants
 * @property {(env: number, row: bigint) => number} mjenv_set_constants_row
 * @property {(env: number, row: bigint, ctrl: number, count: bigint, frames: bigint) => number} mjenv_simulate
 * @property {(env: number, mask: number, from: bigint) => number} mjenv_copy_row
 * @property {(env: number, row: bigint, image: number, capacity_bytes: bigint, size_bytes: number) => number} mjenv_snapshot
 * @property {(env: number, row: bigint, image: number, size_bytes: bigint) => number} mjenv_restore
 * @property {(env: number, document: number) => number} mjenv_randomize
 * @property {(env: number, document: number) => number} mjenv_randomization
 */
