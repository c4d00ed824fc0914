#include "error.hpp"

#include <algorithm>

namespace mjenv::core {
namespace {

// The Levenshtein distance: how many letters to insert, remove or replace to turn one text into the other.
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j - 1] + 1, row[j] + 1});
    }
  }
  return row.back();
}

}  // namespace

std::vector<std::string> nearest(const std::string& given, const std::vector<std::string>& names) {
  constexpr std::size_t kMaxNames = 3, kLongest = 100;
  if (given.empty() || given.size() > kLongest) return {};
  const auto is_last_word_of = [&](const std::string& name) {
    const std::size_t at = name.size() - given.size();
    return name.size() > given.size() && name.compare(at, given.size(), given) == 0 &&
           (name[at - 1] == '.' || name[at - 1] == '_');
  };
  // Distances and names. Sorting keeps the order of names at equal distances, because it compares the pointers.
  std::vector<std::pair<std::size_t, const std::string*>> found;
  for (const std::string& name : names) {
    if (is_last_word_of(name))
      found.emplace_back(0, &name);
    else if (name.find(given) != std::string::npos)
      found.emplace_back(1, &name);
    else if (const std::size_t letters = distance(given, name); letters <= given.size() / 4)
      found.emplace_back(1 + letters, &name);
  }
  std::sort(found.begin(), found.end());
  std::vector<std::string> likeliest;
  for (std::size_t i = 0; i < std::min(found.size(), kMaxNames); ++i) likeliest.push_back(*found[i].second);
  return likeliest;
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

std::string choices(const std::string& given, const std::vector<std::string>& names, const std::string& lister) {
  constexpr std::size_t kFew = 16;
  if (names.size() <= kFew) return "; there are " + listed(names);
  const std::vector<std::string> likely = nearest(given, names);
  return (likely.empty() ? "; " : "; nearest: " + listed(likely) + "; ") + lister + " lists all " +
         std::to_string(names.size());
}

}  // namespace mjenv::core
