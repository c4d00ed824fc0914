#include "json.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "error.hpp"

namespace mjenv::core {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{1} << 24;
constexpr std::size_t kMaxDepth = 16;
constexpr std::size_t kMaxValues = 1'000'000;
constexpr std::size_t kMaxText = 1000;  // so that messages stay short
constexpr std::size_t kMaxMessage = 300;

// Builds the tree from the parser's events.
class Builder : public nlohmann::json_sax<nlohmann::json> {
 public:
  explicit Builder(const std::string& what) : what_(what) { open_.reserve(kMaxDepth); }
  Json take() { return std::move(root_); }

  bool null() override { return add({}); }
  bool boolean(bool value) override { return add({Json::Kind::flag, value, 0, 0, "", "", {}}); }
  bool number_integer(std::int64_t value) override {
    return add({Json::Kind::integer, false, value, static_cast<double>(value), "", "", {}});
  }
  bool number_unsigned(std::uint64_t value) override {
    if (value <= std::uint64_t{INT64_MAX}) return number_integer(static_cast<std::int64_t>(value));
    return add({Json::Kind::real, false, 0, static_cast<double>(value), "", "", {}});
  }
  bool number_float(double value, const std::string& /*token*/) override {
    return add({Json::Kind::real, false, 0, value, "", "", {}});
  }
  bool string(std::string& value) override { return add({Json::Kind::text, false, 0, 0, checked(value), "", {}}); }
  bool binary(nlohmann::json::binary_t& /*value*/) override { return false; }  // not in texts
  bool key(std::string& name) override {
    name_ = checked(name);
    return true;
  }
  bool start_object(std::size_t /*size*/) override { return open(Json::Kind::object); }
  bool start_array(std::size_t /*size*/) override { return open(Json::Kind::list); }
  bool end_array() override {
    open_.pop_back();
    return true;
  }
  bool end_object() override {
    std::vector<const std::string*> names;
    for (const Json& member : open_.back()->items) names.push_back(&member.name);
    std::sort(names.begin(), names.end(), [](const auto* a, const auto* b) { return *a < *b; });
    const auto twice =
        std::adjacent_find(names.begin(), names.end(), [](const auto* a, const auto* b) { return *a == *b; });
    if (twice != names.end()) fail(MJENV_E_NAME, what_ + " has " + quoted(**twice) + " twice in one object");
    return end_array();
  }
  bool parse_error(std::size_t /*position*/, const std::string& /*token*/,
                   const nlohmann::json::exception& error) override {
    std::string why = error.what();  // "[json.exception.parse_error.101] parse error at line 1, column 2: ..."
    why.erase(0, why.find("] ") + 2);
    if (why.size() > kMaxMessage) why = why.substr(0, kMaxMessage) + "...";
    fail(MJENV_E_VALUE, what_ + " is no JSON: " + why);
  }

 private:
  const std::string& what_;
  Json root_;
  std::vector<Json*> open_;  // the lists and objects around the next value
  std::string name_;         // of the next value
  std::size_t count_ = 0;

  std::string checked(std::string& text) const {
    if (text.size() > kMaxText)
      fail(MJENV_E_SIZE, what_ + " has a text of more than " + std::to_string(kMaxText) + " bytes");
    return std::move(text);
  }
  bool add(Json value) {
    if (++count_ > kMaxValues) fail(MJENV_E_SIZE, what_ + " has more than " + std::to_string(kMaxValues) + " values");
    value.name = std::exchange(name_, {});
    if (open_.empty())
      root_ = std::move(value);
    else
      open_.back()->items.push_back(std::move(value));
    return true;
  }
  bool open(Json::Kind kind) {
    if (open_.size() == kMaxDepth)
      fail(MJENV_E_SIZE, what_ + " has more than " + std::to_string(kMaxDepth) + " brackets in each other");
    add({kind, false, 0, 0, "", "", {}});
    open_.push_back(open_.empty() ? &root_ : &open_.back()->items.back());
    return true;
  }
};

void write(const Json& value, std::string& to) {
  const auto put_text = [&](const std::string& text) { to += nlohmann::json(text).dump(); };
  switch (value.kind) {
    case Json::Kind::null: to += "null"; break;
    case Json::Kind::flag: to += value.flag ? "true" : "false"; break;
    case Json::Kind::integer: to += std::to_string(value.integer); break;
    case Json::Kind::real: {
      const std::string digits = number(value.real);
      to += digits.find_first_of(".e") == std::string::npos ? digits + ".0" : digits;
      break;
    }
    case Json::Kind::text: put_text(value.text); break;
    default: {
      const bool is_object = value.kind == Json::Kind::object;
      to += is_object ? '{' : '[';
      bool is_first = true;
      for (const Json& item : value.items) {
        if (is_object && item.kind == Json::Kind::null) continue;
        if (!std::exchange(is_first, false)) to += ',';
        if (is_object) {
          put_text(item.name);
          to += ':';
        }
        write(item, to);
      }
      to += is_object ? '}' : ']';
    }
  }
}

}  // namespace

const Json* Json::find(const std::string& member) const {
  for (const Json& item : items)
    if (item.name == member) return item.kind == Kind::null ? nullptr : &item;
  return nullptr;
}

Json parse_json(const std::string& text, const std::string& what) {
  if (text.size() > kMaxBytes)
    fail(MJENV_E_SIZE, what + " has " + std::to_string(text.size()) + " bytes, more than " + std::to_string(kMaxBytes));
  Builder builder(what);
  nlohmann::json::sax_parse(text, &builder);
  return builder.take();
}

std::string written(const Json& value) {
  std::string text;
  write(value, text);
  return text;
}

}  // namespace mjenv::core
