// A fully connected network: hidden layers with an activation, and a last layer without.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "kernels/kernels.hpp"
#include "random.hpp"

namespace mjenv::learn {

// Where a layer's parameters lie: weights [inputs][outputs], then bias [outputs], both padded with zeros, which stay
// zero. The weights of the last layer, which has few outputs, are [outputs][inputs].
struct Layer {
  int inputs, outputs;                // as the caller counts them
  int padded_inputs, padded_outputs;  // as they are stored
  std::size_t weights, bias;          // the offsets of the first elements
  bool last;

  // The offset of a weight.
  std::size_t weight(int input, int output) const {
    return weights + static_cast<std::size_t>(last ? output * padded_inputs + input : input * padded_outputs + output);
  }
};

class Network {
 public:
  // seen: 0 for inputs that have no effect on the network; empty: all inputs have.
  Network(int inputs, const std::vector<int>& hidden, int outputs, Activation activation, std::vector<int> seen);

  std::size_t size() const { return size_; }  // the number of parameters with padding, a multiple of kLaneBlock
  int input_stride() const { return layers_.front().padded_inputs; }
  int output_stride() const { return layers_.back().padded_outputs; }
  const std::vector<Layer>& layers() const { return layers_; }
  bool sees(int input) const { return seen_.empty() || seen_[static_cast<std::size_t>(input)] != 0; }

  // Sets orthogonal weights, with gain sqrt(2) in hidden layers and `gain` in the last one, and biases of 0.
  void initialize(float* parameters, double gain, Random& random) const;

  // Sets the elements of is_used that are parameters, which begin at `at`, not padding or weights of unseen inputs.
  void mark_used(std::vector<bool>& is_used, std::size_t at) const;

  // The memory that one evaluation of `rows` rows needs besides the parameters.
  class Pass {
   public:
    Pass(const Network& network, int rows);

    // x: [rows][input_stride()]; rows: a multiple of kRowBlock. Returns the outputs [rows][output_stride()].
    const float* forward(const Kernels& kernels, const float* parameters, const float* x, int rows);

    // [rows][output_stride()] the derivatives of the loss with respect to the outputs. The caller sets them before
    // backward(), those of padding outputs to 0.
    float* output_gradient() { return output_gradients_.back().data(); }

    // Writes the derivatives with respect to the parameters to `gradient`, or adds them if `adds`. Call forward() with
    // the same x and rows before. transposed: the weights that transpose() wrote.
    void backward(const Kernels& kernels, const float* parameters, const float* transposed, const float* x, int rows,
                  bool adds, float* gradient);

   private:
    const Network& network_;
    std::vector<std::vector<float>> outputs_, output_gradients_;  // of each layer
  };

  // Writes the transposed weights of the hidden layers after the first. backward() needs them.
  void transpose(const float* parameters, std::vector<float>& transposed) const;
  std::size_t transposed_size() const;

 private:
  std::vector<Layer> layers_;
  Activation activation_;
  std::vector<int> seen_;
  std::size_t size_ = 0;

  void clear_unseen(float* parameters) const;
};

}  // namespace mjenv::learn
