#include "env/writer.hpp"

namespace mjenv::core {

void Writer::prepare(const Schema& schema, const Frames& frames, const std::vector<Array>& arrays) {
  observation_.resize(frames.task_count());
  seen_.resize(static_cast<std::size_t>(schema.observation_count()));
  for (const std::size_t i : schema.exported()) {
    exported_.push_back(with_contacts(arrays[i], schema.max_contacts()));
    work_.expect(part_of(arrays[i].name));
  }
}

const double* Writer::observation() {
  calls_.observe(view_, observation_.data());
  return observation_.data();
}

const double* Writer::given_observation(const Place& given) {
  const auto count = static_cast<std::int64_t>(observation_.size()), first = given.index * count;
  if (given.out.obs && given.out.obs_dtype == MJENV_DTYPE_FLOAT64)
    return static_cast<const double*>(given.out.obs) + first;
  if (given.out.obs)
    std::copy_n(static_cast<const float*>(given.out.obs) + first, count, observation_.data());
  else
    std::fill(observation_.begin(), observation_.end(), 0.0);
  return observation_.data();
}

void Writer::write_observation(void* to, const Place& place) {
  if (!to) return;
  if (place.out.obs_dtype == MJENV_DTYPE_FLOAT32) return write_observation(observation(), to, place);
  calls_.observe(view_, static_cast<double*>(to) + place.index * static_cast<std::int64_t>(observation_.size()));
}

void Writer::write_arrays(const Schema& schema, const Place& place) {
  if (!place.out.arrays) return;
  if (schema.exports_on_demand()) work_.complete();
  const std::vector<Field>& fields = schema.fields(MJENV_ROLE_ARRAYS);
  for (std::size_t i = 0; i < fields.size(); ++i) exported_[i].read(place.out.arrays + place.start(fields[i]));
}

}  // namespace mjenv::core
