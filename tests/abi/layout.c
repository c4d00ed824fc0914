// Prints sizes and offsets of the headers' structs and the values of its enumerators.
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include "mjenv/mjenv.h"
#include "mjenv/task.h"

// Bytes of the present struct that no field has had yet.
static size_t rest;

static void check_no_padding(void) {
  if (rest == 0) return;
  fprintf(stderr, "%zu bytes of padding above: name them as a reserved field\n", rest);
  exit(1);
}

#define STRUCT(type)                                      \
  do {                                                    \
    check_no_padding();                                   \
    rest = sizeof(type);                                  \
    printf("struct " #type " %zu bytes\n", sizeof(type)); \
  } while (0)
#define FIELD(type, name)                                                                 \
  do {                                                                                    \
    const size_t size_ = sizeof(((type*)0)->name);                                        \
    rest -= size_;                                                                        \
    printf("field " #type " " #name " at %zu, %zu bytes\n", offsetof(type, name), size_); \
  } while (0)
#define ENUM(type) printf("enum " #type " %zu bytes\n", sizeof(type))
#define VALUE(name) printf("value " #name " %d\n", (int)(name))

int main(void) {
  printf("MJENV_ABI_VERSION %d\n", MJENV_ABI_VERSION);
  printf("MJENV_ALL_ROWS %d\n", MJENV_ALL_ROWS);
  printf("MJENV_CAMERA_FREE %d\n", MJENV_CAMERA_FREE);
  printf("MJENV_BODY_UNSET %d\n", MJENV_BODY_UNSET);

  ENUM(mjenv_status);
  VALUE(MJENV_OK);
  VALUE(MJENV_DIVERGED);
  VALUE(MJENV_E_ARGUMENT);
  VALUE(MJENV_E_NAME);
  VALUE(MJENV_E_TYPE);
  VALUE(MJENV_E_VALUE);
  VALUE(MJENV_E_SIZE);
  VALUE(MJENV_E_NOT_RESET);
  VALUE(MJENV_E_EPISODE_ENDED);
  VALUE(MJENV_E_PENDING);
  VALUE(MJENV_E_NOT_PENDING);
  VALUE(MJENV_E_FORKED);
  VALUE(MJENV_E_FILE);
  VALUE(MJENV_E_BUSY);
  VALUE(MJENV_E_MODEL);
  VALUE(MJENV_E_PHYSICS);
  VALUE(MJENV_E_SNAPSHOT);
  VALUE(MJENV_E_MEMORY);
  VALUE(MJENV_E_INTERNAL);
  VALUE(MJENV_E_RENDER);
  VALUE(MJENV_E_TASK);

  ENUM(mjenv_distribution);
  VALUE(MJENV_DISTRIBUTION_UNIFORM);
  VALUE(MJENV_DISTRIBUTION_NORMAL);
  VALUE(MJENV_DISTRIBUTION_INTEGERS);

  ENUM(mjenv_dtype);
  VALUE(MJENV_DTYPE_FLOAT64);
  VALUE(MJENV_DTYPE_FLOAT32);
  VALUE(MJENV_DTYPE_INT64);
  VALUE(MJENV_DTYPE_INT32);
  VALUE(MJENV_DTYPE_UINT8);
  VALUE(MJENV_DTYPE_ACTION);
  VALUE(MJENV_DTYPE_NATIVE_FLOAT);
  VALUE(MJENV_DTYPE_NATIVE_INT);

  ENUM(mjenv_role);
  VALUE(MJENV_ROLE_OBSERVATION);
  VALUE(MJENV_ROLE_ACTION);
  VALUE(MJENV_ROLE_INFO);
  VALUE(MJENV_ROLE_RESET_INFO);
  VALUE(MJENV_ROLE_REWARD);
  VALUE(MJENV_ROLE_STRUCTURE);
  VALUE(MJENV_ROLE_DATA);
  VALUE(MJENV_ROLE_MODEL);
  VALUE(MJENV_ROLE_ARRAYS);
  VALUE(MJENV_ROLE_PARAMETERS);
  VALUE(MJENV_ROLE_GROUPS);

  ENUM(mjenv_kind);
  VALUE(MJENV_KIND_FLAG);
  VALUE(MJENV_KIND_INTEGER);
  VALUE(MJENV_KIND_REALS);
  VALUE(MJENV_KIND_STRING);
  VALUE(MJENV_KIND_STRING_OR_INT);

  STRUCT(mjenv_option);
  FIELD(mjenv_option, struct_size);
  FIELD(mjenv_option, kind);
  FIELD(mjenv_option, name);
  FIELD(mjenv_option, doc);
  FIELD(mjenv_option, low);
  FIELD(mjenv_option, high);
  FIELD(mjenv_option, count);
  FIELD(mjenv_option, choices);

  STRUCT(mjenv_field);
  FIELD(mjenv_field, struct_size);
  FIELD(mjenv_field, ndim);
  FIELD(mjenv_field, name);
  FIELD(mjenv_field, doc);
  FIELD(mjenv_field, shape);
  FIELD(mjenv_field, offset);
  FIELD(mjenv_field, count);
  FIELD(mjenv_field, dtype);
  FIELD(mjenv_field, reserved);

  STRUCT(mjenv_space);
  FIELD(mjenv_space, struct_size);
  FIELD(mjenv_space, dtype);
  FIELD(mjenv_space, count);
  FIELD(mjenv_space, low);
  FIELD(mjenv_space, high);
  FIELD(mjenv_space, ndim);
  FIELD(mjenv_space, reserved);
  FIELD(mjenv_space, shape);

  STRUCT(mjenv_info);
  FIELD(mjenv_info, struct_size);
  FIELD(mjenv_info, threads);
  FIELD(mjenv_info, rows);
  FIELD(mjenv_info, frame_skip);
  FIELD(mjenv_info, lanes);
  FIELD(mjenv_info, lanes_reason);

  STRUCT(mjenv_spec);
  FIELD(mjenv_spec, struct_size);
  FIELD(mjenv_spec, version);
  FIELD(mjenv_spec, id);
  FIELD(mjenv_spec, robot);
  FIELD(mjenv_spec, max_episode_steps);
  FIELD(mjenv_spec, reward_threshold);
  FIELD(mjenv_spec, camera_distance);
  FIELD(mjenv_spec, camera_elevation);
  FIELD(mjenv_spec, camera_lookat);
  FIELD(mjenv_spec, camera_trackbodyid);
  FIELD(mjenv_spec, revision);
  FIELD(mjenv_spec, model_xml);

  STRUCT(mjenv_batch);
  FIELD(mjenv_batch, struct_size);
  FIELD(mjenv_batch, obs_dtype);
  FIELD(mjenv_batch, rows);
  FIELD(mjenv_batch, obs_count);
  FIELD(mjenv_batch, info_count);
  FIELD(mjenv_batch, reset_info_count);
  FIELD(mjenv_batch, arrays_count);
  FIELD(mjenv_batch, obs);
  FIELD(mjenv_batch, reward);
  FIELD(mjenv_batch, terminated);
  FIELD(mjenv_batch, truncated);
  FIELD(mjenv_batch, status);
  FIELD(mjenv_batch, info);
  FIELD(mjenv_batch, was_reset);
  FIELD(mjenv_batch, reset_info);
  FIELD(mjenv_batch, final_obs);
  FIELD(mjenv_batch, final_info);
  FIELD(mjenv_batch, arrays);

  ENUM(mjenv_gl);
  VALUE(MJENV_GL_AUTO);
  VALUE(MJENV_GL_EGL);
  VALUE(MJENV_GL_OSMESA);
  VALUE(MJENV_GL_GLFW);
  VALUE(MJENV_GL_WGL);

  ENUM(mjenv_visual);
  VALUE(MJENV_VISUAL_CONVEXHULL);
  VALUE(MJENV_VISUAL_TEXTURE);
  VALUE(MJENV_VISUAL_JOINT);
  VALUE(MJENV_VISUAL_CAMERA);
  VALUE(MJENV_VISUAL_ACTUATOR);
  VALUE(MJENV_VISUAL_ACTIVATION);
  VALUE(MJENV_VISUAL_LIGHT);
  VALUE(MJENV_VISUAL_TENDON);
  VALUE(MJENV_VISUAL_RANGEFINDER);
  VALUE(MJENV_VISUAL_CONSTRAINT);
  VALUE(MJENV_VISUAL_INERTIA);
  VALUE(MJENV_VISUAL_SCLINERTIA);
  VALUE(MJENV_VISUAL_PERTFORCE);
  VALUE(MJENV_VISUAL_PERTOBJ);
  VALUE(MJENV_VISUAL_CONTACTPOINT);
  VALUE(MJENV_VISUAL_CONTACTFORCE);
  VALUE(MJENV_VISUAL_CONTACTSPLIT);
  VALUE(MJENV_VISUAL_TRANSPARENT);
  VALUE(MJENV_VISUAL_AUTOCONNECT);
  VALUE(MJENV_VISUAL_COM);
  VALUE(MJENV_VISUAL_SELECT);
  VALUE(MJENV_VISUAL_STATIC);
  VALUE(MJENV_VISUAL_SKIN);
  ENUM(mjenv_label);
  VALUE(MJENV_LABEL_NONE);
  VALUE(MJENV_LABEL_BODY);
  VALUE(MJENV_LABEL_JOINT);
  VALUE(MJENV_LABEL_GEOM);
  VALUE(MJENV_LABEL_SITE);
  VALUE(MJENV_LABEL_CAMERA);
  VALUE(MJENV_LABEL_LIGHT);
  VALUE(MJENV_LABEL_TENDON);
  VALUE(MJENV_LABEL_ACTUATOR);
  VALUE(MJENV_LABEL_CONSTRAINT);
  VALUE(MJENV_LABEL_SKIN);
  VALUE(MJENV_LABEL_SELECTION);
  VALUE(MJENV_LABEL_SELPNT);
  VALUE(MJENV_LABEL_CONTACTFORCE);
  ENUM(mjenv_frame);
  VALUE(MJENV_FRAME_NONE);
  VALUE(MJENV_FRAME_BODY);
  VALUE(MJENV_FRAME_GEOM);
  VALUE(MJENV_FRAME_SITE);
  VALUE(MJENV_FRAME_CAMERA);
  VALUE(MJENV_FRAME_LIGHT);
  VALUE(MJENV_FRAME_CONTACT);
  VALUE(MJENV_FRAME_WORLD);

  STRUCT(mjenv_render_settings);
  FIELD(mjenv_render_settings, struct_size);
  FIELD(mjenv_render_settings, gl);
  FIELD(mjenv_render_settings, width);
  FIELD(mjenv_render_settings, height);
  FIELD(mjenv_render_settings, camera);
  FIELD(mjenv_render_settings, max_geom);
  FIELD(mjenv_render_settings, samples);
  FIELD(mjenv_render_settings, shadows);
  FIELD(mjenv_render_settings, reflections);
  FIELD(mjenv_render_settings, reserved);
  FIELD(mjenv_render_settings, camera_name);
  FIELD(mjenv_render_settings, lookat);
  FIELD(mjenv_render_settings, distance);
  FIELD(mjenv_render_settings, azimuth);
  FIELD(mjenv_render_settings, elevation);
  FIELD(mjenv_render_settings, visual);
  FIELD(mjenv_render_settings, geomgroup);
  FIELD(mjenv_render_settings, sitegroup);
  FIELD(mjenv_render_settings, jointgroup);
  FIELD(mjenv_render_settings, tendongroup);
  FIELD(mjenv_render_settings, actuatorgroup);
  FIELD(mjenv_render_settings, skingroup);
  FIELD(mjenv_render_settings, reserved_bytes);
  FIELD(mjenv_render_settings, label);
  FIELD(mjenv_render_settings, frame);
  FIELD(mjenv_render_settings, wireframe);
  FIELD(mjenv_render_settings, additive);
  FIELD(mjenv_render_settings, skybox);
  FIELD(mjenv_render_settings, fog);
  FIELD(mjenv_render_settings, haze);
  FIELD(mjenv_render_settings, cull_face);
  check_no_padding();

  STRUCT(mjenv_task_option);
  FIELD(mjenv_task_option, struct_size);
  FIELD(mjenv_task_option, kind);
  FIELD(mjenv_task_option, name);
  FIELD(mjenv_task_option, doc);
  FIELD(mjenv_task_option, value);
  FIELD(mjenv_task_option, low);
  FIELD(mjenv_task_option, high);
  FIELD(mjenv_task_option, values);
  FIELD(mjenv_task_option, count);
  FIELD(mjenv_task_option, text);
  FIELD(mjenv_task_option, choices);
  FIELD(mjenv_task_option, live);
  FIELD(mjenv_task_option, reserved);

  STRUCT(mjenv_task_field);
  FIELD(mjenv_task_field, struct_size);
  FIELD(mjenv_task_field, role);
  FIELD(mjenv_task_field, name);
  FIELD(mjenv_task_field, doc);
  FIELD(mjenv_task_field, dtype);
  FIELD(mjenv_task_field, ndim);
  FIELD(mjenv_task_field, shape);
  FIELD(mjenv_task_field, group);

  STRUCT(mjenv_task_camera);
  FIELD(mjenv_task_camera, struct_size);
  FIELD(mjenv_task_camera, trackbodyid);
  FIELD(mjenv_task_camera, distance);
  FIELD(mjenv_task_camera, lookat);
  FIELD(mjenv_task_camera, elevation);

  STRUCT(mjenv_contact);
  FIELD(mjenv_contact, geom1);
  FIELD(mjenv_contact, geom2);
  FIELD(mjenv_contact, distance);
  FIELD(mjenv_contact, position);
  FIELD(mjenv_contact, frame);
  FIELD(mjenv_contact, force);

  STRUCT(mjenv_sim);
  FIELD(mjenv_sim, struct_size);
  FIELD(mjenv_sim, action_dtype);
  FIELD(mjenv_sim, api);
  FIELD(mjenv_sim, nq);
  FIELD(mjenv_sim, nv);
  FIELD(mjenv_sim, na);
  FIELD(mjenv_sim, nu);
  FIELD(mjenv_sim, nbody);
  FIELD(mjenv_sim, njnt);
  FIELD(mjenv_sim, ngeom);
  FIELD(mjenv_sim, nsite);
  FIELD(mjenv_sim, ntendon);
  FIELD(mjenv_sim, nsensordata);
  FIELD(mjenv_sim, contact_count);
  FIELD(mjenv_sim, reserved);
  FIELD(mjenv_sim, timestep);
  FIELD(mjenv_sim, dt);
  FIELD(mjenv_sim, time);
  FIELD(mjenv_sim, action);
  FIELD(mjenv_sim, carried);
  FIELD(mjenv_sim, qpos);
  FIELD(mjenv_sim, qvel);
  FIELD(mjenv_sim, act);
  FIELD(mjenv_sim, ctrl);
  FIELD(mjenv_sim, qacc);
  FIELD(mjenv_sim, xpos);
  FIELD(mjenv_sim, xquat);
  FIELD(mjenv_sim, xmat);
  FIELD(mjenv_sim, xipos);
  FIELD(mjenv_sim, ximat);
  FIELD(mjenv_sim, xanchor);
  FIELD(mjenv_sim, xaxis);
  FIELD(mjenv_sim, geom_xpos);
  FIELD(mjenv_sim, geom_xmat);
  FIELD(mjenv_sim, site_xpos);
  FIELD(mjenv_sim, site_xmat);
  FIELD(mjenv_sim, subtree_com);
  FIELD(mjenv_sim, cinert);
  FIELD(mjenv_sim, cvel);
  FIELD(mjenv_sim, cfrc_ext);
  FIELD(mjenv_sim, sensordata);
  FIELD(mjenv_sim, actuator_length);
  FIELD(mjenv_sim, actuator_velocity);
  FIELD(mjenv_sim, actuator_force);
  FIELD(mjenv_sim, qfrc_actuator);
  FIELD(mjenv_sim, qfrc_passive);
  FIELD(mjenv_sim, qfrc_bias);
  FIELD(mjenv_sim, qfrc_constraint);
  FIELD(mjenv_sim, ten_length);
  FIELD(mjenv_sim, ten_velocity);
  FIELD(mjenv_sim, contacts);
  FIELD(mjenv_sim, qpos0);
  FIELD(mjenv_sim, body_mass);
  FIELD(mjenv_sim, arrays);
  FIELD(mjenv_sim, parameters);
  FIELD(mjenv_sim, action_count);
  FIELD(mjenv_sim, reserved2);

  STRUCT(mjenv_start);
  FIELD(mjenv_start, struct_size);
  FIELD(mjenv_start, reserved);
  FIELD(mjenv_start, api);
  FIELD(mjenv_start, random);
  FIELD(mjenv_start, qpos0);
  FIELD(mjenv_start, qpos);
  FIELD(mjenv_start, qvel);
  FIELD(mjenv_start, act);
  FIELD(mjenv_start, carried);
  FIELD(mjenv_start, arrays);
  FIELD(mjenv_start, nq);
  FIELD(mjenv_start, nv);
  FIELD(mjenv_start, na);
  FIELD(mjenv_start, carry_count);
  FIELD(mjenv_start, parameters);
  FIELD(mjenv_start, sim);
  FIELD(mjenv_start, time);
  FIELD(mjenv_start, own);

  STRUCT(mjenv_outcome);
  FIELD(mjenv_outcome, struct_size);
  FIELD(mjenv_outcome, terminated);
  FIELD(mjenv_outcome, reward);
  FIELD(mjenv_outcome, info);
  FIELD(mjenv_outcome, carried);
  FIELD(mjenv_outcome, random);
  FIELD(mjenv_outcome, own);
  FIELD(mjenv_outcome, qvel);

  STRUCT(mjenv_control);
  FIELD(mjenv_control, struct_size);
  FIELD(mjenv_control, substep);
  FIELD(mjenv_control, ctrl);
  FIELD(mjenv_control, carried);
  FIELD(mjenv_control, random);
  FIELD(mjenv_control, own);
  FIELD(mjenv_control, qvel);

  STRUCT(mjenv_task);
  FIELD(mjenv_task, struct_size);
  FIELD(mjenv_task, revision);
  FIELD(mjenv_task, id);
  FIELD(mjenv_task, model);
  FIELD(mjenv_task, model_text);
  FIELD(mjenv_task, frame_skip);
  FIELD(mjenv_task, has_reward_threshold);
  FIELD(mjenv_task, reward_threshold);
  FIELD(mjenv_task, time_limit);
  FIELD(mjenv_task, carry_count);
  FIELD(mjenv_task, camera);
  FIELD(mjenv_task, options);
  FIELD(mjenv_task, option_count);
  FIELD(mjenv_task, fields);
  FIELD(mjenv_task, field_count);
  FIELD(mjenv_task, user);
  FIELD(mjenv_task, build);
  FIELD(mjenv_task, destroy);
  FIELD(mjenv_task, reset);
  FIELD(mjenv_task, reset_info);
  FIELD(mjenv_task, carry);
  FIELD(mjenv_task, observe);
  FIELD(mjenv_task, step);
  FIELD(mjenv_task, caller_thread);
  FIELD(mjenv_task, physics_only);
  FIELD(mjenv_task, fixed_model);
  FIELD(mjenv_task, fixed_frame_skip);
  FIELD(mjenv_task, before_step);
  FIELD(mjenv_task, before_substep);
  FIELD(mjenv_task, compute_reward);

  STRUCT(mjenv_plugin);
  FIELD(mjenv_plugin, struct_size);
  FIELD(mjenv_plugin, abi_version);
  FIELD(mjenv_plugin, tasks);
  FIELD(mjenv_plugin, task_count);

  STRUCT(mjenv_task_api);
  FIELD(mjenv_task_api, struct_size);
  FIELD(mjenv_task_api, abi_version);
  FIELD(mjenv_task_api, fail_with);
  FIELD(mjenv_task_api, integer);
  FIELD(mjenv_task_api, reals);
  FIELD(mjenv_task_api, is_integer);
  FIELD(mjenv_task_api, text);
  FIELD(mjenv_task_api, index);
  FIELD(mjenv_task_api, option_index);
  FIELD(mjenv_task_api, norm_is_fused);
  FIELD(mjenv_task_api, need);
  FIELD(mjenv_task_api, array);
  FIELD(mjenv_task_api, field);
  FIELD(mjenv_task_api, carry);
  FIELD(mjenv_task_api, carry_bounds);
  FIELD(mjenv_task_api, random);
  FIELD(mjenv_task_api, uniform);
  FIELD(mjenv_task_api, normal);
  FIELD(mjenv_task_api, integers);
  FIELD(mjenv_task_api, choice);
  FIELD(mjenv_task_api, sample);
  FIELD(mjenv_task_api, permutation);
  FIELD(mjenv_task_api, parameter);
  FIELD(mjenv_task_api, keep);
  FIELD(mjenv_task_api, current);
  FIELD(mjenv_task_api, own);
  FIELD(mjenv_task_api, random_state);
  FIELD(mjenv_task_api, forward);
  FIELD(mjenv_task_api, advance);
  FIELD(mjenv_task_api, restart);
  FIELD(mjenv_task_api, contact_count);
  FIELD(mjenv_task_api, state_rand);
  FIELD(mjenv_task_api, state_uniform);
  FIELD(mjenv_task_api, state_randn);
  FIELD(mjenv_task_api, state_randint);
  FIELD(mjenv_task_api, state_choice);
  FIELD(mjenv_task_api, state_is_new);
  FIELD(mjenv_task_api, action);
  FIELD(mjenv_task_api, state_permutation);
  FIELD(mjenv_task_api, control_forward);

  STRUCT(mjenv_builder);
  FIELD(mjenv_builder, struct_size);
  FIELD(mjenv_builder, failed);
  FIELD(mjenv_builder, api);
  FIELD(mjenv_builder, sim);
  FIELD(mjenv_builder, random);
  FIELD(mjenv_builder, task);

  STRUCT(mjenv_random);
  FIELD(mjenv_random, struct_size);
  FIELD(mjenv_random, reserved);
  FIELD(mjenv_random, api);
  return 0;
}
