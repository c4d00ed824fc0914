// The models in use. Environments with the same model share it.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>

namespace mjenv::core {

class Model;

// A call that finds another thread inside does nothing instead of waiting, because in a forked child that thread may
// not exist. Then a model is compiled once more, or its entry is dropped by a later call.
class Cache {
 public:
  // Returns the model that was added with this key, or null.
  std::shared_ptr<const Model> find(const std::string& key);
  void add(const std::string& key, const std::shared_ptr<const Model>& model);
  // Drops the entries of models that are no longer in use.
  void tidy();

 private:
  using Models = std::map<std::string, std::weak_ptr<const Model>>;
  std::atomic<bool> busy_{false};
  // Null while there are no models. No destructor frees it, because environments may outlive this object.
  Models* models_ = nullptr;

  // Calls the body, unless another thread is inside.
  template <typename F>
  void alone(const F& body);
};

}  // namespace mjenv::core
