// Steps rows in lanes and one by one, and compares all arrays of mjData.
#pragma once

// Before cmocka's macro fail:
#include "engine/mujoco.hpp"
#include "error.hpp"

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/lanes/frame/stepper.hpp"
#include "engine/lanes/mujoco2/lanes.hpp"
#include "engine/model.hpp"
#include "engine/own_arrays.hpp"
#include "engine/work.hpp"
#include "noise.hpp"
#include "registry.hpp"
#include "run.hpp"

namespace mjenv::core::lanes_tests {

constexpr int kRows = 120, kFewRows = 48;  // of each kind of state
extern int share;                          // of these rows, one of so many is stepped
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinite = std::numeric_limits<double>::infinity();

// How wild the random states are. Lanes compute the tame ones themselves, except where MuJoCo warns. In tiny ones, velocities
// are negative zeros, and so are accelerations by controls. Those at the limit have numbers around the greatest that MuJoCo
// allows.
enum class Kind { at_rest, tame, odd, fast, bad, tiny, at_limit };
std::vector<double> random_state(const mjModel& m, const StateLayout& layout, Kind kind, Noise& noise);

// The name of an array in which two work spaces differ, "" if there is none. Only of arrays that may be read.
std::string difference(Work& got, Work& want);

bool ends_with(const std::string& name, const std::string& end);

struct Counts {
  int rows = 0, left = 0, contacts = 0, constraints = 0;
};

// Steps `width` random states of a kind in lanes and one by one. Says where they part, "" if nowhere. own: the arrays of
// which the rows have their own values. frames: 0 calls mj_forward.
std::string compare(const Model& model, lanes::Stepper& stepper, std::vector<std::unique_ptr<Work>>& works, Work& plain,
                    const OwnArrays& own, Kind kind, int frames, Noise& noise, Counts& counts);

// Whether MuJoCo resets the simulation in this step, or fails.
bool diverges(Work& work, int frames, double* before);

// Whether a step may read the array.
bool is_read(const std::string& name);

// The arrays of which rows can have their own values
std::vector<Array> writable_arrays(const Model& model);

// Of rows in usual states, those that lanes may leave to MuJoCo: one of so many
struct Leavable {
  int of_shared = 20;  // of rows that share the model
  int of_own = 2;      // of rows with values of their own
};

// Steps rows in lanes of this stepper.
std::string compare(const std::shared_ptr<const Model>& model, int width, lanes::Stepper& stepper, const OwnArrays& own,
                    int rows);

// How often constraints were made in lanes, how often those of contacts were, and how often in compare_own before rows had
// values of their own.
extern int made, made_of_contacts, made_of_shared;
// How many rows Newton's solver has left to MuJoCo.
extern int left_by_solver;
extern const lanes::Code* counted;
void count_making(lanes::Lanes& d, const lanes::Contacts& contacts, lanes::Constraints& c);

// Rows that share the model, rows with values of their own, some of them with frames of their own, and again rows that share
// it, on one stepper.
std::string compare(const std::shared_ptr<const Model>& model, int rows = kRows, Leavable leavable = {});

extern std::string failures;

std::string with(const std::string& from, const std::string& to, std::string text);
std::string in_front_of_body(const std::string& what, const std::string& text);

// Slightly different values of an array for a row
std::vector<double> other_values(const OwnArray& array, Noise& noise);
using Values = std::function<std::vector<double>(const OwnArray& array, Noise& noise)>;

// Steps rows that differ in one array, of which `values` chooses those of the next row. Says where lanes and MuJoCo part,
// or that lanes leave other rows than those of `left` (bits); "" if neither. Lanes make the constraints of all frames but
// the last, first with the values that the rows share, then with their own.
std::string compare_own(const std::shared_ptr<const Model>& model, const std::string& array,
                        const Values& values = other_values, std::uint32_t left = 0, int frames = 1,
                        Kind kind = Kind::tame);

// The odd rows, as bits
constexpr std::uint32_t kOddRows = 0xAAAAAAAA;
// The values of the model; in odd rows, a number instead of the last `count` of them, or of all
Values in_odd_rows(double number, std::ptrdiff_t count = 0);

// Work spaces of rows that are stepped together, and the memory for their states before the last frame
struct Group {
  std::vector<std::unique_ptr<Work>> works;
  std::vector<Work*> some;
  std::vector<std::vector<double>> befores;
  std::vector<double*> before;

  Group(const std::shared_ptr<const Model>& model, int width)
      : befores(static_cast<std::size_t>(width), std::vector<double>(StateLayout(*model).size)) {
    for (auto& state : befores) {
      works.push_back(std::make_unique<Work>(model));
      some.push_back(works.back().get());
      before.push_back(state.data());
    }
  }
};

// Steps a row from each state. Compares those rows that lanes do not leave to MuJoCo, and returns them, as bits.
// expected: an array that is read after the step; "" if no more is read than after every step.
std::uint32_t step_rows(const std::shared_ptr<const Model>& model, lanes::Stepper& stepper,
                        std::vector<std::vector<double>> states, const std::string& expected = "");

// Where a test writes the state of a row
struct RowState {
  double *qpos, *qvel, *warmstart, *ctrl;
};
using SetState = std::function<void(std::size_t row, const RowState& state)>;

// Calls step_rows with rows for the widest lanes, on the same stepper for each of `sets`, which change the model's
// initial state. Returns what the last call returns.
std::uint32_t step_from(const std::shared_ptr<const Model>& model, const std::vector<SetState>& sets,
                        const std::string& expected = "");

void keep_state(std::size_t row, const RowState& state);

// The model's initial state, once for each of the widest lanes. In odd rows, the number with this index is another one.
std::vector<std::vector<double>> states_with(const Model& model, std::size_t index, double number);

void assert_names(const std::string& found, const char* word);

}  // namespace mjenv::core::lanes_tests
