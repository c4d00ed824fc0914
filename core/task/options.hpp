// The constructor options of one id. The task's definition and the library declare them, and the caller sets them.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "mjenv/mjenv.h"

namespace mjenv::core {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Whether the identity of images (env/image.hpp) contains the option's value, so that an image fits only environments
// with the same value.
enum class InIdentity {
  yes,  // the option changes the results of steps and resets
  // The option changes only how results are computed and returned. Or the identity contains what the option decides
  // (the model, the rounding of norms).
  no
};

struct Option {
  Option(mjenv_kind its_kind, std::string its_name, std::string its_doc, InIdentity is_in_identity,
         double min = -kInfinity, double max = kInfinity)
      : kind(its_kind),
        in_identity(is_in_identity),
        name(std::move(its_name)),
        doc(std::move(its_doc)),
        low(min),
        high(max) {}

  mjenv_kind kind;
  InIdentity in_identity;
  std::string name, doc;
  double low, high;     // closed bounds
  std::string choices;  // the valid texts, separated by blanks; empty: any text is valid

  std::int64_t integer = 0;       // the value of a FLAG, an INTEGER, and a STRING_OR_INT that is an index
  std::vector<double> reals;      // the value of REALS
  std::string text;               // the value of a STRING, and a STRING_OR_INT that is a name
  bool live = false;              // each row has its own numbers (Parameters)
  bool given_as_integer = false;  // set_integer has set the value, or the default is an index

  std::vector<std::string> list_of_choices() const;
  // Whether the text is valid for a STRING.
  bool allows(const std::string& given) const;
};

// The kind in words, such as "an integer", for messages.
const char* kind_name(mjenv_kind kind);

class Options {
 public:
  explicit Options(std::string id) : id_(std::move(id)) {}

  const std::string& id() const { return id_; }
  const std::vector<Option>& all() const { return options_; }

  // Each of these declares an option with its default and returns it. If it is already declared, it returns the option
  // with its present value.
  const Option& flag(const char* name, bool value, const char* doc, InIdentity in_identity = InIdentity::yes);
  const Option& integer(const char* name, std::int64_t value, std::int64_t low, std::int64_t high, const char* doc,
                        InIdentity in_identity = InIdentity::yes);
  const Option& reals(const char* name, std::vector<double> values, const char* doc, double low = -kInfinity,
                      double high = kInfinity);
  const Option& text(const char* name, const char* value, const char* doc, const char* choices = "",
                     InIdentity in_identity = InIdentity::yes);
  const Option& text_or_index(const char* name, std::int64_t value, const char* doc);

  const Option& add(Option option) { return declare(std::move(option)); }

  const Option& get(const std::string& name) const;
  void set_integer(const std::string& name, std::int64_t value);
  void set_reals(const std::string& name, const double* values, std::size_t count);
  void set_string(const std::string& name, const std::string& value);

 private:
  std::string id_;
  std::vector<Option> options_;

  const Option& declare(Option option);
  Option& find(const std::string& name);
  [[noreturn]] void refuse_type(const Option& option, const char* given) const;
  static void check_bounds(const Option& option, double value);
};

}  // namespace mjenv::core
