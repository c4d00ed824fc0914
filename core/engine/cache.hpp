// The models in use, by what they were made from: environments of one model share it.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>

namespace mjenv::core {

class Model;

// Whoever finds another thread inside goes without, because a fork may have left that thread behind: a model is then
// made once more, or its entry is dropped with a later one's.
class Cache {
 public:
  // Null if there is none.
  std::shared_ptr<const Model> find(const std::string& key);
  void add(const std::string& key, const std::shared_ptr<const Model>& model);
  // Drops the entries of models that nobody uses any more.
  void tidy();

 private:
  using Models = std::map<std::string, std::weak_ptr<const Model>>;
  std::atomic<bool> busy_{false};
  Models* models_ =
      nullptr;  // null while there are none, as environments may outlive this object when the process ends

  template <typename F>
  void alone(const F& body);
};

}  // namespace mjenv::core
