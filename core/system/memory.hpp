#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>

namespace mjenv::core {

// How many bytes this process can still allocate.
double free_memory();

// Throws if there is not enough memory for `count` objects of `bytes_each` bytes. The allocation itself might succeed,
// but the system would kill the process later, when it writes to the memory. what: names the objects in the message,
// such as " rows".
void check_memory(std::int64_t count, const char* what, std::uint64_t bytes_each);

// The same for `bytes` in all. what: "3 rows".
void check_memory(const std::string& what, double bytes);

// An array of numbers, which are 0 at first. If it is large, the system gives it memory only page by page, when a page
// is first written.
class Zeros {
 public:
  Zeros() = default;
  explicit Zeros(std::size_t count) : data_(static_cast<double*>(std::calloc(count, sizeof(double)))) {
    if (!data_ && count > 0) throw std::bad_alloc();
  }
  double* data() { return data_.get(); }

 private:
  struct Free {
    void operator()(double* data) const noexcept { std::free(data); }
  };
  std::unique_ptr<double[], Free> data_;
};

}  // namespace mjenv::core
