// The live parameters of a task: options for which each row has its own numbers. The caller can write these while the
// task runs.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "task/field.hpp"
#include "task/options.hpp"

namespace mjenv::core {

class Parameters {
 public:
  // Adds a parameter for an option of the kind REALS. Every row begins with the option's value.
  void add(const Option& option);

  // Their names are those by which mjenv_read and mjenv_write know them, such as "parameters.speed".
  const std::vector<Field>& fields() const { return fields_; }
  // The numbers with which a row begins: those of the first parameter, then those of the second, and so on.
  const std::vector<double>& defaults() const { return defaults_; }

  static std::string name_of(const std::string& option);
  // Whether an array's name is that of a parameter. If the task has no such parameter, find throws.
  static bool is_name(const std::string& array);
  const Field& find(const std::string& array, const std::string& id) const;
  // Throws unless the option could have these values.
  void check(const Field& field, const double* values) const;
  // Whether a row can have these numbers. Used to check the numbers that an image contains.
  bool is_valid(const double* numbers) const;

 private:
  struct Bounds {
    double low, high;
  };
  std::vector<Field> fields_;
  std::vector<Bounds> bounds_;  // of the numbers of each field
  std::vector<double> defaults_;

  bool is_within(std::size_t field, double value) const {
    return bounds_[field].low <= value && value <= bounds_[field].high;  // false if it is NaN
  }
};

}  // namespace mjenv::core
