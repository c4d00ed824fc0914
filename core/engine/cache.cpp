#include "engine/cache.hpp"

namespace mjenv::core {

template <typename F>
void Cache::alone(const F& body) {
  if (busy_.exchange(true, std::memory_order_acquire)) return;
  struct Leave {
    std::atomic<bool>& busy;
    ~Leave() { busy.store(false, std::memory_order_release); }
  } leave{busy_};
  body();
}

std::shared_ptr<const Model> Cache::find(const std::string& key) {
  std::shared_ptr<const Model> found;
  alone([&] {
    if (!models_) return;
    const auto entry = models_->find(key);
    if (entry != models_->end()) found = entry->second.lock();
  });
  return found;
}

void Cache::add(const std::string& key, const std::shared_ptr<const Model>& model) {
  alone([&] {
    if (!models_) models_ = new Models;
    (*models_)[key] = model;
  });
}

void Cache::tidy() {
  alone([&] {
    if (!models_) return;
    for (auto entry = models_->begin(); entry != models_->end();)
      entry = entry->second.expired() ? models_->erase(entry) : std::next(entry);
    if (!models_->empty()) return;
    delete models_;
    models_ = nullptr;
  });
}

}  // namespace mjenv::core
