// The models of the suite, as MJCF.
#pragma once

#include <cstddef>
#include <string>

namespace suite {

struct Model {
  const char *name, *text;
};
// assets/*.xml, with what they include.
extern const Model models[];
extern const std::size_t model_count;

// The text of assets/NAME.xml.
std::string model(const std::string& name);

// Models that depend on a number.
std::string cartpole_model(int poles);
std::string swimmer_model(int links);
std::string lqr_model(int balls, int motors);

}  // namespace suite
