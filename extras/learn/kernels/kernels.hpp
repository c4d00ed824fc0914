// The arithmetic on whole arrays. Each instruction set has a table of these functions. All tables give the same bits:
// whatever the width of a vector, an element is computed by the same operations in the same order, and no
// multiplication is fused with an addition.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace mjenv::learn {

// Rows of batches, and widths of layers, are padded to multiples of these numbers.
constexpr int kRowBlock = 8, kLaneBlock = 16, kInputBlock = 4;

constexpr int padded(int count, int block) { return (count + block - 1) / block * block; }

// The function after a layer, and the names in the same order.
enum class Activation { kIdentity, kTanh, kRelu, kElu, kUnknown };
constexpr std::array<std::string_view, 4> kActivations = {"identity", "tanh", "relu", "elu"};
inline Activation activation_named(std::string_view name) {
  return static_cast<Activation>(std::find(kActivations.begin(), kActivations.end(), name) - kActivations.begin());
}

// The numbers of one step of Adam. rate and second_root contain the bias corrections.
struct AdamStep {
  float scale;        // the factor of the gradient, which clips its norm
  float rate;         // the learning rate / (1 - beta1^t)
  float second_root;  // 1 / sqrt(1 - beta2^t)
  float beta1, beta2, epsilon;
};

struct Kernels {
  const char* name;

  // y[rows][outputs] = x[rows][inputs] w[inputs][outputs] + bias[outputs]; bias null: zeros. Each sum begins with the
  // bias and adds its products in the order of the inputs. rows: a multiple of kRowBlock; outputs: of kLaneBlock.
  void (*product)(const float* x, int stride, int rows, int inputs, const float* w, int outputs, const float* bias,
                  float* y);
  // y[rows][outputs] = x[rows][inputs] w[outputs][inputs]^T + bias[outputs], for layers of few outputs. stride: of y. In
  // each sum, lane l of kLaneBlock adds the products l, l + kLaneBlock and so on; then the second half of the lanes is
  // added to the first until one is left, and at last the bias. rows: a multiple of kRowBlock; inputs: of kLaneBlock.
  void (*dots)(const float* x, int rows, int inputs, const float* w, int outputs, const float* bias, int stride,
               float* y);
  // g[inputs][outputs] = x[rows][inputs]^T d[rows][outputs], or += if `adds`. Sums are in the order of the rows, and are
  // then added to g. inputs: a multiple of kInputBlock; outputs: of kLaneBlock.
  void (*gradient)(const float* x, int stride, int rows, int inputs, const float* d, int outputs, bool adds, float* g);
  // h[outputs] = the sum of the rows of d[rows][outputs] in their order, or += if `adds`.
  void (*sum_rows)(const float* d, int rows, int outputs, bool adds, float* h);

  // The others work on count numbers, a multiple of kLaneBlock.
  void (*activate)(Activation activation, float* y, std::size_t count);
  // Multiplies d by the derivative of the activation, which is computed from the activation's outputs y.
  void (*derive)(Activation activation, const float* y, float* d, std::size_t count);
  void (*exp)(float* x, std::size_t count);
  void (*add)(const float* from, float* to, std::size_t count);
  // Adds the squares of elements l, l + kLaneBlock and so on to lanes[l], for the lanes of a SumOfSquares.
  void (*squares)(const float* x, std::size_t count, float* lanes);
  void (*adam)(const AdamStep& step, const float* gradient, float* first, float* second, float* parameters,
               std::size_t count);
};

// A sum of squares. Its numbers can be added in several parts, which changes no bit if they follow each other in order.
struct SumOfSquares {
  float lanes[kLaneBlock] = {};

  void add(const Kernels& kernels, const float* x, std::size_t count) { kernels.squares(x, count, lanes); }
  double total() const {
    double sum = 0;
    for (const float lane : lanes) sum += lane;
    return sum;
  }
};

// The tables that this CPU can run, the one with the widest vectors last.
std::vector<const Kernels*> usable_kernels();

// The table for the setting "instructions". Throws if the CPU lacks it.
const Kernels& chosen_kernels(const std::string& instructions = "auto");

}  // namespace mjenv::learn
