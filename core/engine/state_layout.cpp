#include "engine/state_layout.hpp"

#include <utility>

#include "engine/mujoco.hpp"

namespace mjenv::core {

std::optional<StateLayout::Part> StateLayout::part(const std::string& array) const {
  if (kNormalizesMocap && array == "mocap_quat") return Part{size - more, more};
  std::size_t offset = 0;
  for (const auto& [name, count] : {std::pair<const char*, std::size_t>{"time", 1},
                                    {"qpos", nq},
                                    {"qvel", nv},
                                    {"act", na},
                                    {"qacc_warmstart", nv},
                                    {"ctrl", nu}}) {
    if (array == name) return Part{offset, count};
    offset += count;
  }
  return std::nullopt;
}

}  // namespace mjenv::core
